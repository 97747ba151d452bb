// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/osl_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <set>
#include <utility>

#include "closures/closure_pool.h"
#include "core/error.h"
#include "forms/albedo_text.h"
#include "model/horizon.h"
#include "print/osl_library.h"
#include "print/osl_text.h"
#include "print/osl_words.h"

namespace brdfc::forms {
namespace {

using print::block;
using print::number;

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

/// Numbers that are sockets are kept within their ranges, which sliders keep but links do not: a texture may be black.
std::string within_ranges(const ModelInfo& info, const ParamValues& fixed, const std::string& statements) {
  std::string bounds, names;
  for (const ParamInfo& p : info.params) {
    if (p.kind != ParamKind::Number || fixed.count(p.name)) continue;
    if (!std::regex_search(statements, std::regex("\\b" + p.name + "\\b"))) continue;
    // A parameter cannot be assigned to, but hidden by a variable of its name.
    bounds += fmt::format("    float bounded_{0} = clamp({0}, {1}, {2});\n", p.name, number(p.min), number(p.max));
    names += fmt::format("    float {0} = bounded_{0};\n", p.name);
  }
  return bounds.empty() ? statements : bounds + "    {\n" + print::indented(names + statements, 1) + "    }\n";
}

/// Statements that declare the frame.
std::string frame_text(const Model& model, double lowest_view) {
  std::string text = "    vector shading_n = normalize(Normal), frame_n = shading_n;\n";
  if (const std::vector<Recording> bend = record_bending(model); !bend.empty())
    text += "    float mirror_rise;\n" + block(bend[0].statements, 1) +
            "    if (mirror_rise < 0.0 && brdfc_has_true_normal()) {\n" + print::indented(bend[1].statements, 2) +
            "    }\n";
  if (lowest_view > 0) text += fmt::format("    frame_n = brdfc_facing(frame_n, {});\n", lowest_view);
  return text;
}

std::string closure_text(const RecordedClosure& closure, std::size_t i, const std::string& diffuse_n) {
  const std::string n = closure.turned ? fmt::format("normal_{}", i) : "frame_n";
  const auto microfacet = [&](const char* distribution) {
    // The viewer's direction lies in the plane of incidence. Along the normal, where it is no tangent, facets are not
    // stretched by it, and Cycles takes none.
    const std::string tangent = closure.stretched == Tangent::View      ? "I"
                                : closure.stretched == Tangent::Surface ? fmt::format("tangent_{}", i)
                                                                        : "vector(0.0)";
    return fmt::format("weight_{0} * microfacet(\"{1}\", {2}, {3}, alpha_{0}, {4}_{0}, 1.0, 0)", i, distribution, n,
                       tangent, closure.stretched == Tangent::None ? "alpha" : "alpha_across");
  };
  switch (closure.kind) {
    case ClosureKind::Diffuse:
      return fmt::format("weight_{} * brdfc_diffuse({})", i, closure.turned ? n : diffuse_n);
    case ClosureKind::Burley:
      return fmt::format("weight_{0} * burley_diffuse_bsdf({1}, color(1), roughness_{0})", i, n);
    case ClosureKind::OrenNayar:
      return fmt::format("weight_{0} * oren_nayar_diffuse_bsdf({1}, albedo_{0}, roughness_{0})", i, n);
    case ClosureKind::Velvet:
      return fmt::format("weight_{0} * ashikhmin_velvet({1}, roughness_{0})", i, n);
    case ClosureKind::DiffuseRamp:
      return fmt::format("weight_{} * diffuse_ramp({}, ramp_{})", i, n, i);
    case ClosureKind::Reflection:
      return fmt::format("weight_{} * reflection({})", i, n);
    case ClosureKind::Refraction:
      return fmt::format("weight_{} * refraction({}, ior_{})", i, n, i);
    case ClosureKind::GlossyToon:
      return fmt::format("weight_{0} * glossy_toon({1}, size_{0}, smooth_{0})", i, n);
    case ClosureKind::DiffuseToon:
      return fmt::format("weight_{0} * diffuse_toon({1}, size_{0}, smooth_{0})", i, n);
    case ClosureKind::PhongRamp:
      return fmt::format("weight_{} * phong_ramp({}, exponent_{}, ramp_{})", i, n, i, i);
    case ClosureKind::Ggx:
      return microfacet("ggx");
    case ClosureKind::Beckmann:
      return microfacet("beckmann");
  }
  throw std::logic_error("no OSL for this closure");
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
  return {recording_of(model, rise, 0), recording_of(model, bend, 0)};
}

int ray_bytes(const Model& model) { return pool_bytes(ClosureKind::PhongRamp) + (model.has_through() ? kPoolNode : 0); }

std::string lost_below(const Model& model, const std::string& wi, const std::string& weight) {
  const char* reflects = model.has_through() ? "dot({0}, frame_n) > 0.0 && " : "";
  return fmt::format(
      fmt::runtime(std::string("    if (") + reflects + "brdfc_is_below({0}, 0.0))\n        {1} = 0.0;\n"), wi, weight);
}

std::vector<RecordedClosure> ShaderText::record(
    ChoiceSwitch& by_choice, const std::function<Recording(const Choices&, const ParamValues&)>& recording) {
  const ModelInfo& info = model.info();
  std::vector<RecordedClosure> closures;
  int operations = 0;
  for (const Choices& choices : choice_combinations(info)) {
    if (!admits(info, choices, setting.fixed)) continue;
    const Recording r = recording(choices, with_choices(info, choices, setting.fixed));
    operations = std::max(operations, r.operations);
    by_choice.add(choices, arrays.without_shared(r));
    if (r.closures.empty()) continue;
    if (!closures.empty() && closures != r.closures)
      throw std::logic_error(info.name + ": closures must be the same for every combination of choices that has any");
    closures = r.closures;
  }
  shader.operations += operations;
  return closures;
}

void ShaderText::declare(const std::vector<RecordedClosure>& closures, const std::string& diffuse_n) {
  for (std::size_t c = 0; c < closures.size(); ++c) {
    const ClosureKind kind = closures[c].kind;
    // 0 for choices without closures.
    statements += fmt::format("    color weight_{} = 0.0;\n", c);
    if (has_ramp(kind)) statements += fmt::format("    color ramp_{}[{}];\n", c, kRampSize);
    if (kind == ClosureKind::PhongRamp) statements += fmt::format("    float exponent_{};\n", c);
    if (has_matte_roughness(kind)) statements += fmt::format("    float roughness_{};\n", c);
    if (kind == ClosureKind::OrenNayar) statements += fmt::format("    color albedo_{};\n", c);
    if (has_cone(kind)) statements += fmt::format("    float size_{0}, smooth_{0};\n", c);
    if (has_facets(kind)) statements += fmt::format("    float alpha_{};\n", c);
    if (closures[c].stretched != Tangent::None) statements += fmt::format("    float alpha_across_{};\n", c);
    if (closures[c].stretched == Tangent::Surface)
      statements += fmt::format("    float tangent_{0}_x, tangent_{0}_y, tangent_{0}_z;\n", c);
    if (kind == ClosureKind::Refraction) statements += fmt::format("    float ior_{};\n", c);
    if (closures[c].turned) statements += fmt::format("    float normal_{0}_x, normal_{0}_y, normal_{0}_z;\n", c);
    shader.facets = shader.facets || has_facets(kind);
    shader.leaning = shader.leaning || closures[c].turned;
    terms.push_back(closure_text(closures[c], c, diffuse_n));
    shader.slots += slots(kind);
    shader.closure_bytes += pool_bytes(kind);
  }
}

void ShaderText::scale(const std::vector<RecordedClosure>& closures, const std::set<std::string>& factors) {
  for (std::size_t c = 0; c < closures.size(); ++c)
    if (closures[c].division != Division::Done) {
      const std::string weight = fmt::format("weight_{}", c);
      statements += fmt::format(
          "    for (int entry = 0; entry < {}; entry++)\n        ramp_{}[entry] /= {};\n", kRampSize, c,
          closures[c].division == Division::ByLargest ? fmt::format("brdfc_max_component({})", weight) : weight);
      ++shader.operations;
    }
  for (const std::string& name : factors) {
    for (std::size_t c = 0; c < closures.size(); ++c)
      if (closures[c].kind != ClosureKind::Reflection) statements += fmt::format("    weight_{} *= {};\n", c, name);
    ++shader.operations;
  }
}

void ShaderText::turn(const std::vector<RecordedClosure>& closures) {
  for (std::size_t c = 0; c < closures.size(); ++c) {
    if (closures[c].stretched == Tangent::Surface)
      statements += fmt::format(
          "    vector tangent_{0} = frame_t * tangent_{0}_x + frame_b * tangent_{0}_y + frame_n * tangent_{0}_z;\n", c);
    if (closures[c].turned)
      statements += fmt::format(
          "    normal normal_{0} = normalize(frame_t * normal_{0}_x + frame_b * normal_{0}_y + frame_n * "
          "normal_{0}_z);\n",
          c);
  }
}

void OslForm::write_closures(ShaderText& text) const {
  ChoiceSwitch by_choice(text.model.info(), text.setting.fixed);
  const auto closures = text.record(by_choice, [&](const Choices&, const ParamValues& values) {
    return recordings(text.model, values, text.setting).at(0);
  });
  // As Blender's nodes do, where closures are not parts of a sum that holds for one frame alone.
  text.declare(closures, made_of_fit() ? "frame_n" : "shading_n");
  text.statements += by_choice.print(4);
  // Closures of a fit are made without them.
  text.scale(closures, made_of_fit() ? fit::roles_of(text.model, text.setting.fixed).with(fit::Role::Factor)
                                     : std::set<std::string>());
  text.turn(closures);
}

Shader OslForm::write(const Model& model, const measure::AlbedoTable& table, const Setting& given) const {
  const ModelInfo& info = model.info();
  Setting setting = given;
  ParamValues& fixed = setting.fixed;
  for (const auto& [name, value] : values(model, given.fixed))
    if (fixed.emplace(name, value).first->second != value)
      input_error("{}: the {} form exists only for {}", info.name, this->name(), format_values(info, {{name, value}}));
  ShaderText made{model, setting};
  Shader& shader = made.shader;
  shader.name = fmt::format("brdfc_{}_{}", info.name, name());

  ChoiceSwitch mirror(info, fixed);
  const bool with_mirror = draws() && model.has_mirror();
  write_closures(made);
  if (with_mirror)
    made.record(mirror, [&](const Choices&, const ParamValues& v) { return record_mirror(model, v, 0); });

  const std::string normal = frame_text(model, lowest_view());
  std::string body = normal;
  body +=
      "    vector frame_t, frame_b;\n"
      "    brdfc_frame(frame_n, Tangent, frame_t, frame_b);\n"
      "    // Towards the viewer: I in Cycles points away from the surface.\n"
      "    float wo_x = dot(I, frame_t);\n    float wo_y = dot(I, frame_b);\n    float wo_z = dot(I, frame_n);\n\n";
  if (model.two_sided())
    body +=
        "    // frame_n is on the viewer's side; the model's z leaves the object.\n"
        "    float side = backfacing() ? -1.0 : 1.0;\n";
  if (model.has_medium() || draws())
    body += "    float path_length = 0;\n    getattribute(\"path:ray_length\", path_length);\n";
  body += made.arrays.print();
  if (with_mirror) {
    body += "    color mirror_weight;\n" + block(mirror.print(0), 1);
    made.terms.push_back("mirror_weight * reflection(frame_n)");
    shader.slots += slots(ClosureKind::Reflection);
    shader.closure_bytes += pool_bytes(ClosureKind::Reflection);
  }
  body += made.statements;
  shader.closures = int(made.terms.size()) + std::max(shader.lamps - 1, 0);
  shader.closure_bytes += std::max(int(made.terms.size()) - (shader.lamps > 0 ? 1 : 0) - 1, 0) * kPoolNode;
  if (shader.slots > kMaxClosures)
    input_error("{}: the {} form needs {} closure slots, and Cycles keeps {}", info.name, name(), shader.slots,
                kMaxClosures);
  body += "    BSDF = " + print::balanced_sum(made.terms) + ";\n\n";
  std::string of_albedo;
  if (model.has_scatter()) {
    of_albedo = albedo_text(info, table, fixed);
    if (of_albedo.size() <= kMaxAlbedoText) body += std::exchange(of_albedo, "");
  } else {
    // Delta terms alone: all of their closures are terms.
    body += "    Albedo = weight_0";
    for (std::size_t c = 1; c < made.terms.size(); ++c) body += fmt::format(" + weight_{}", c);
    body += ";\n";
  }

  // Each ends a line; the semicolons of a loop's head do not.
  for (std::size_t at = body.find(";\n"); at != std::string::npos; at = body.find(";\n", at + 1)) ++shader.statements;

  std::string parameters;
  for (const ParamInfo& p : info.params) {
    if (fixed.count(p.name)) continue;
    if (p.kind == ParamKind::Choice && p.choices.size() == 1) continue;  // nothing to choose
    parameters += parameter(p);
  }
  const auto text = [&](const std::string& name, const std::string& what, const std::string& sockets,
                        const std::string& statements) {
    return print::comment(fmt::format("{}: {}. Generated by brdfc {}.", info.label, info.paper, BRDFC_VERSION)) +
           print::comment(fmt::format("{}. {}", what, info.equations)) +
           "// SPDX-License-Identifier: GPL-3.0-or-later\n\n" +
           print::narrow(print::library_for(statements) + fmt::format("\nshader {}(\n", name) + parameters + sockets +
                         ")\n{\n" + within_ranges(info, fixed, statements) + "}\n");
  };
  const char* albedo_output = "    output color Albedo = 0";
  std::string sockets;
  for (int i = 1; i <= shader.lamps; ++i)
    for (const char* what : {"Place", "Turn", "Scale", "Shape"})
      sockets += fmt::format("    vector Lamp{}{} = vector(0.0),\n", what, i);
  sockets +=
      "    normal Normal = N,\n    vector Tangent = vector(0, 0, 0),\n"
      "    output closure color BSDF = 0";
  if (of_albedo.empty()) sockets += fmt::format(",\n{}", albedo_output);
  shader.source = text(shader.name, fmt::format("Form: {}", name()), sockets, body);
  if (!of_albedo.empty())
    shader.albedo = text(shader.name + "_albedo", fmt::format("Albedo of the form: {}", name()),
                         fmt::format("    normal Normal = N,\n{}", albedo_output),
                         normal + "    float wo_z = dot(I, frame_n);\n" + of_albedo);
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
