// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/osl_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "core/error.h"
#include "forms/albedo_output.h"
#include "model/horizon.h"
#include "print/osl_library.h"
#include "print/osl_statements.h"
#include "print/osl_text.h"

namespace brdfc::forms {
namespace {

using print::append;
using print::assign;
using print::call;
using print::element;
using print::number;
using print::operation;
using print::Statements;
using print::Value;

std::string parameter(const ParamInfo& p) {
  const std::string meta =
      fmt::format(" [[ string label = {}, string help = {} ]],\n", print::quoted(p.label), print::quoted(p.doc));
  switch (p.kind) {
    case ParamKind::Number:
      return fmt::format("    float {} = {}", p.name, number(p.value[0])) + meta;
    case ParamKind::Color:
      return fmt::format("    color {} = {}", p.name, print::color(p.value)) + meta;
    default:
      return fmt::format("    int {} = {}", p.name, int(p.value[0])) + meta;
  }
}

/// A parameter within its range. Colors may be brighter, as in Blender, unless that has no meaning.
Value within_range(const ParamInfo& p) {
  if (p.kind == ParamKind::Number) return call("clamp", {p.name, p.min, p.max});
  const auto grey = [](double value) { return call("color", {value}); };
  return p.may_exceed ? call("max", {p.name, grey(p.min)}) : call("clamp", {p.name, grey(p.min), grey(p.max)});
}

/// Prints a shader's statements, with the sockets clamped to their ranges: sliders stay within them, but linked values
/// may not, for example a black texture or the sum of two. The count does not include the statements that clamp.
print::OslText within_ranges(const ModelInfo& info, const ParamValues& fixed, const Statements& statements) {
  const std::set<std::string> read = print::names_in(statements);
  Statements bounds, bounded;
  for (const ParamInfo& p : info.params) {
    if (p.kind == ParamKind::Choice || fixed.count(p.name) || !read.count(p.name)) continue;
    // A parameter cannot be assigned to, but a variable of the same name can hide it.
    const char* type = p.kind == ParamKind::Color ? "color" : "float";
    bounds.push_back(print::declare(type, "bounded_" + p.name, within_range(p)));
    bounded.push_back(print::declare(type, p.name, "bounded_" + p.name));
  }
  if (bounds.empty()) return print::osl_statements(statements, 1);
  print::OslText out = print::osl_statements(statements, 2);
  out.text =
      print::osl_statements(bounds, 1).text + "    {\n" + print::osl_statements(bounded, 2).text + out.text + "    }\n";
  return out;
}

/// Statements that declare the frame.
Statements frame_of(const Model& model, double lowest_view) {
  Statements out = {print::Declare{
      "vector", {{"shading_n", {call("brdfc_shading_normal", {"Normal"})}}, {"frame_n", {"shading_n"}}}}};
  if (const std::vector<Recording> bend = record_bending(model); !bend.empty()) {
    const auto run = [](const Recording& r) { return print::Run{r.program, r.taken}; };
    out.push_back(print::declare("float", "mirror_rise"));
    out.push_back(print::Block{{run(bend[0])}});
    out.push_back(
        print::If{print::all_of({operation("mirror_rise", "<", 0.0), call("brdfc_has_true_normal")}), {run(bend[1])}});
  }
  if (lowest_view > 0) out.push_back(assign("frame_n", call("brdfc_facing", {"frame_n", lowest_view})));
  return out;
}

std::string numbered(const char* name, std::size_t i) { return fmt::format("{}_{}", name, i); }

Value closure_of(const RecordedClosure& closure, std::size_t i, const std::string& diffuse_n) {
  const std::string n = closure.turned ? numbered("normal", i) : "frame_n";
  const auto of = [&](const char* name) { return Value(numbered(name, i)); };
  const auto microfacet = [&](const char* distribution) {
    // The viewer's direction lies in the plane of incidence. If it is parallel to the normal it is no valid tangent,
    // but then facets are not stretched by it, and Cycles uses no tangent.
    const Value tangent = closure.stretched == Tangent::View      ? Value("I")
                          : closure.stretched == Tangent::Surface ? of("tangent")
                                                                  : call("vector", {0.0});
    return call("microfacet", {print::quotation(distribution), n, tangent, of("alpha"),
                               of(closure.stretched == Tangent::None ? "alpha" : "alpha_across"), 1.0, 0});
  };
  const auto lobe = [&]() -> Value {
    switch (closure.kind) {
      case ClosureKind::Diffuse:
        return call("brdfc_diffuse", {closure.turned ? n : diffuse_n});
      case ClosureKind::Burley:
        return call("burley_diffuse_bsdf", {n, call("color", {1}), of("roughness")});
      case ClosureKind::OrenNayar:
        return call("oren_nayar_diffuse_bsdf", {n, of("albedo"), of("roughness")});
      case ClosureKind::Velvet:
        return call("ashikhmin_velvet", {n, of("roughness")});
      case ClosureKind::DiffuseRamp:
        return call("diffuse_ramp", {n, of("ramp")});
      case ClosureKind::Reflection:
        return call("reflection", {n});
      case ClosureKind::Refraction:
        return call("refraction", {n, of("ior")});
      case ClosureKind::GlossyToon:
        return call("glossy_toon", {n, of("size"), of("smooth")});
      case ClosureKind::DiffuseToon:
        return call("diffuse_toon", {n, of("size"), of("smooth")});
      case ClosureKind::PhongRamp:
        return call("phong_ramp", {n, of("exponent"), of("ramp")});
      case ClosureKind::Ggx:
        return microfacet("ggx");
      case ClosureKind::Beckmann:
        return microfacet("beckmann");
    }
    throw std::logic_error("no OSL for this closure");
  };
  return of("weight") * lobe();
}

}  // namespace

std::vector<Recording> record_bending(const Model& model) {
  if (model.info().look == Look::Matte) return {};
  Recorder recorder;
  const auto input_vector = [](const std::string& name) {
    return Vec3<Expr>{Expr::input(name + "[0]"), Expr::input(name + "[1]"), Expr::input(name + "[2]")};
  };
  const Vec3<Expr> geometric = input_vector("Ng"), wo = input_vector("I"), n = input_vector("shading_n");
  Program rise, bend;
  rise.output("mirror_rise", mirror_rise(geometric, wo, n));
  const Vec3<Expr> bent = bent_normal(geometric, wo, n);
  bend.output("frame_n[0]", bent.x);
  bend.output("frame_n[1]", bent.y);
  bend.output("frame_n[2]", bent.z);
  return {recording_of(model, std::move(rise)), recording_of(model, std::move(bend))};
}

Statements declare_draws() {
  print::Declare numbers{"float", {}};
  for (int i = 0; i < 3; ++i) numbers.variables.push_back({fmt::format("u_{}", i), {element("u_all", i)}});
  return {print::declare("vector", "u_all", call("brdfc_random", {0, "path_length"})), numbers};
}

Value in_scene(Value x, Value y, Value z) {
  return Value("frame_t") * std::move(x) + Value("frame_b") * std::move(y) + Value("frame_n") * std::move(z);
}
Value in_scene(const std::string& name) { return in_scene(name + "_x", name + "_y", name + "_z"); }

print::Statement lost_below(const Model& model, const std::string& wi, const std::string& weight) {
  std::vector<Value> lost;
  if (model.has_through()) lost.push_back(operation(call("dot", {wi, "frame_n"}), ">", 0.0));
  lost.push_back(call("brdfc_is_below", {wi, 0.0}));
  return print::If{print::all_of(lost), {assign(weight, 0.0)}};
}

std::vector<RecordedClosure> ShaderBody::record(
    ChoiceSwitch& by_choice, const std::function<Recording(const Choices&, const ParamValues&)>& recording) {
  const ModelInfo& info = model.info();
  std::vector<RecordedClosure> closures;
  int operations = 0;
  for (const Choices& choices : choice_combinations(info)) {
    if (!admits(info, choices, setting.fixed)) continue;
    const Recording r = recording(choices, with_choices(info, choices, setting.fixed));
    operations = std::max(operations, r.operations());
    by_choice.add(choices, arrays.run(r));
    if (r.closures.empty()) continue;
    if (!closures.empty() && closures != r.closures)
      throw std::logic_error(info.name + ": closures must be the same for every combination of choices that has any");
    closures = r.closures;
  }
  shader.operations += operations;
  return closures;
}

void ShaderBody::declare(const std::vector<RecordedClosure>& closures, const std::string& diffuse_n) {
  for (std::size_t c = 0; c < closures.size(); ++c) {
    const ClosureKind kind = closures[c].kind;
    const auto variable = [&](const char* type, const char* name) { add(print::declare(type, numbered(name, c))); };
    const auto components = [&](const char* name) {
      const std::string of = numbered(name, c);
      add(print::declare_all("float", {of + "_x", of + "_y", of + "_z"}));
    };
    // Weight 0 for choices without closures.
    add(print::declare("color", numbered("weight", c), 0.0));
    if (has_ramp(kind)) add(print::Declare{"color", {{numbered("ramp", c), {}, kRampSize}}});
    if (kind == ClosureKind::PhongRamp) variable("float", "exponent");
    if (has_matte_roughness(kind)) variable("float", "roughness");
    if (kind == ClosureKind::OrenNayar) variable("color", "albedo");
    if (has_cone(kind)) add(print::declare_all("float", {numbered("size", c), numbered("smooth", c)}));
    if (has_facets(kind)) variable("float", "alpha");
    if (closures[c].stretched != Tangent::None) variable("float", "alpha_across");
    if (closures[c].stretched == Tangent::Surface) components("tangent");
    if (kind == ClosureKind::Refraction) variable("float", "ior");
    if (closures[c].turned) components("normal");
    shader.facets = shader.facets || has_facets(kind);
    shader.leaning = shader.leaning || closures[c].turned;
    terms.push_back(closure_of(closures[c], c, diffuse_n));
    shader.slots += slots(kind);
  }
}

void ShaderBody::scale(const std::vector<RecordedClosure>& closures, const std::set<std::string>& factors) {
  for (std::size_t c = 0; c < closures.size(); ++c)
    if (closures[c].division != Division::Done) {
      const Value weight = numbered("weight", c);
      const Value by = closures[c].division == Division::ByLargest ? call("brdfc_max_component", {weight}) : weight;
      add(print::Loop{"entry", int(kRampSize), {print::Assign{element(numbered("ramp", c), "entry"), by, "/="}}});
      ++shader.operations;
    }
  for (const std::string& name : factors) {
    for (std::size_t c = 0; c < closures.size(); ++c)
      if (closures[c].kind != ClosureKind::Reflection) add(print::Assign{numbered("weight", c), name, "*="});
    ++shader.operations;
  }
}

void ShaderBody::turn(const std::vector<RecordedClosure>& closures) {
  for (std::size_t c = 0; c < closures.size(); ++c) {
    const std::string tangent = numbered("tangent", c), normal = numbered("normal", c);
    if (closures[c].stretched == Tangent::Surface) add(print::declare("vector", tangent, in_scene(tangent)));
    if (closures[c].turned) add(print::declare("normal", normal, call("normalize", {in_scene(normal)})));
  }
}

void OslForm::make_closures(ShaderBody& body) const {
  ChoiceSwitch by_choice(body.model.info(), body.setting.fixed);
  const auto closures = body.record(by_choice, [&](const Choices&, const ParamValues& values) {
    return recordings(body.model, values, body.setting).at(0);
  });
  // Blender's nodes use the shading normal. Closures of a fit are parts of a sum that is right in one frame only.
  body.declare(closures, made_of_fit() ? "frame_n" : "shading_n");
  body.add(by_choice.statements());
  // The closures of a fit do not contain the factors.
  body.scale(closures, made_of_fit() ? fit::roles_of(body.model, body.setting.fixed).with(fit::Role::Factor)
                                     : std::set<std::string>());
  body.turn(closures);
}

Shader OslForm::write(const Model& model, const measure::AlbedoTable& table, const Setting& given) const {
  const ModelInfo& info = model.info();
  Setting setting = given;
  ParamValues& fixed = setting.fixed;
  for (const auto& [name, value] : values(model, given.fixed))
    if (fixed.emplace(name, value).first->second != value)
      input_error("{}: the {} form exists only for {}", info.name, this->name(), format_values(info, {{name, value}}));
  ShaderBody made{model, setting};
  Shader& shader = made.shader;
  shader.name = fmt::format("brdfc_{}_{}", info.name, name());

  ChoiceSwitch mirror(info, fixed);
  const bool with_mirror = draws() && model.has_mirror();
  make_closures(made);
  if (with_mirror) made.record(mirror, [&](const Choices&, const ParamValues& v) { return record_mirror(model, v); });

  const Statements normal = frame_of(model, lowest_view());
  Statements body = normal;
  const auto add = [&](print::Statement statement) { body.push_back(std::move(statement)); };
  add(print::declare_all("vector", {"frame_t", "frame_b"}));
  add(print::Perform{call("brdfc_frame", {"frame_n", "Tangent", "frame_t", "frame_b"})});
  add(print::Comment{"Towards the viewer: I in Cycles points away from the surface."});
  for (const auto& [wo, axis] :
       {std::pair("wo_x", "frame_t"), std::pair("wo_y", "frame_b"), std::pair("wo_z", "frame_n")})
    add(print::declare("float", wo, call("dot", {"I", axis})));
  add(print::Gap{});
  if (model.two_sided()) {
    add(print::Comment{"frame_n is on the viewer's side; the model's z leaves the object."});
    add(print::declare("float", "side", print::choice(call("backfacing"), -1.0, 1.0)));
  }
  if (model.has_medium() || draws()) {
    add(print::declare("float", "path_length", 0));
    add(print::Perform{call("getattribute", {print::quotation("path:ray_length"), "path_length"})});
  }
  append(body, made.arrays.declarations());
  if (with_mirror) {
    add(print::declare("color", "mirror_weight"));
    append(body, print::scope(mirror.statements()));
    made.terms.push_back(Value("mirror_weight") * call("reflection", {"frame_n"}));
    shader.slots += slots(ClosureKind::Reflection);
  }
  Statements sum = made.statements;
  shader.closures = int(made.terms.size()) + std::max(shader.lamps - 1, 0);
  if (shader.slots > kMaxClosures)
    input_error("{}: the {} form needs {} closure slots, and Cycles keeps {}", info.name, name(), shader.slots,
                kMaxClosures);
  sum.push_back(assign("BSDF", print::balanced_sum(made.terms)));
  append(body, made.of_whole);
  if (made.whole) sum = {print::If{operation("whole", "!=", 0.0), {assign("BSDF", *made.whole)}, sum}};
  append(body, sum);
  add(print::Gap{});
  Statements of_albedo;
  const bool with_albedo = info.properties.albedo_table;
  if (!with_albedo) {
  } else if (model.has_scatter()) {
    of_albedo = albedo_output(info, table, fixed);
    if (print::osl_statements(of_albedo, 1).text.size() <= kMaxAlbedoText) append(body, std::exchange(of_albedo, {}));
  } else {
    // The model has only delta terms, so its albedo is the sum of their weights.
    Value sum = numbered("weight", 0);
    for (std::size_t c = 1; c < made.terms.size(); ++c) sum = sum + numbered("weight", c);
    add(assign("Albedo", sum));
  }

  std::string parameters;
  for (const ParamInfo& p : info.params) {
    if (fixed.count(p.name)) continue;
    if (p.kind == ParamKind::Choice && p.choices.size() == 1) continue;  // nothing to choose
    parameters += parameter(p);
  }
  const auto text = [&](const std::string& name, const std::string& what, const std::string& sockets,
                        const Statements& statements) {
    print::OslText bounded = within_ranges(info, fixed, statements);
    bounded.text =
        print::comment(fmt::format("{}: {}. Generated by brdfc {}.", info.label, info.paper, BRDFC_VERSION)) +
        print::comment(fmt::format("{}. {}", what, info.equations)) +
        "// SPDX-License-Identifier: GPL-3.0-or-later\n\n" +
        print::narrow(print::library_for(print::functions_in(statements)) + fmt::format("\nshader {}(\n", name) +
                      parameters + sockets + ")\n{\n" + bounded.text + "}\n");
    return bounded;
  };
  const char* albedo_socket = "    output color Albedo = 0";
  std::string sockets;
  for (int i = 1; i <= shader.lamps; ++i)
    for (const char* what : {"Place", "Turn", "Scale", "Shape"})
      sockets += fmt::format("    vector Lamp{}{} = vector(0.0),\n", what, i);
  sockets +=
      "    vector Normal = vector(0, 0, 0),\n    vector Tangent = vector(0, 0, 0),\n"
      "    output closure color BSDF = 0";
  if (with_albedo && of_albedo.empty()) sockets += fmt::format(",\n{}", albedo_socket);
  print::OslText whole = text(shader.name, fmt::format("Form: {}", name()), sockets, body);
  shader.source = std::move(whole.text);
  shader.statements = whole.statements;
  if (!of_albedo.empty()) {
    Statements apart = normal;
    apart.push_back(print::declare("float", "wo_z", call("dot", {"I", "frame_n"})));
    append(apart, std::move(of_albedo));
    shader.albedo = text(shader.name + "_albedo", fmt::format("Albedo of the form: {}", name()),
                         fmt::format("    vector Normal = vector(0, 0, 0),\n{}", albedo_socket), apart)
                        .text;
  }
  return shader;
}

std::vector<std::string> warnings_of_closures(const Model& model, const Shader& shader) {
  const bool mirror = model.has_mirror();
  std::vector<std::string> codes;
  if (shader.leaning) codes.push_back("bump_correction");
  if (mirror) codes.insert(codes.end(), {"multiple_importance", "clamp_mirror"});
  if (shader.facets) codes.push_back("caustics");
  if (mirror || shader.facets) codes.push_back("filter_glossy");
  return codes;
}

}  // namespace brdfc::forms
