// SPDX-License-Identifier: GPL-3.0-or-later
// The form of nodes: a model's formulas as trees of Blender's own Math nodes, around its Toon, Glossy and Diffuse
// nodes. Runs wherever Cycles does, with Open Shading Language and without. How its parts are wired is in the
// extension's formula_nodes.py; what they are made of is here: recordings as JSON.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>

#include "closures/closure_pool.h"
#include "forms/error.h"
#include "forms/form.h"
#include "forms/node_lamps.h"
#include "measure/probes.h"
#include "model/horizon.h"
#include "model/under.h"
#include "print/node_program.h"

namespace brdfc::forms {
namespace {

using Json = nlohmann::ordered_json;
using print::NodeOperand;
using print::NodeProgram;

Json operand_json(const NodeOperand& o) {
  if (o.result >= 0) return "$" + std::to_string(o.result);
  if (!o.input.empty()) return o.input;
  if (!o.color) return float(o.value[0]);
  return {float(o.value[0]), float(o.value[1]), float(o.value[2])};
}

Json json_of(const NodeProgram& program) {
  Json inputs = Json::array(), operations = Json::array(), outputs = Json::array();
  for (const auto& [name, color] : program.inputs) inputs.push_back({name, color ? "VECTOR" : "FLOAT"});
  for (const print::NodeOperation& o : program.operations) {
    Json line = {o.kind};
    for (const NodeOperand& a : o.operands) line.push_back(operand_json(a));
    operations.push_back(line);
  }
  for (const auto& [name, o] : program.outputs)
    outputs.push_back({name, o.color ? "VECTOR" : "FLOAT", operand_json(o)});
  return {{"inputs", inputs}, {"operations", operations}, {"outputs", outputs}, {"live", program.live}};
}

/// What parts have vectors for.
const std::set<std::string> kVectors = {"across", "along",   "at",   "away", "normal", "place", "ray", "scale",
                                        "shape",  "towards", "true", "turn", "view",   "wi",    "wo"};

/// Records a program by itself.
template <class Outputs> NodeProgram recorded(const Outputs& outputs) {
  Recorder recorder;
  Program program;
  outputs(program);
  return print::node_program(program, kVectors);
}

/// The parts that are the same for all models.
NodeProgram record_bend() {
  return recorded([](Program& p) {
    const Vec3<Expr> g = input3("true"), wo = input3("view"), n = input3("normal");
    const Condition bends = mirror_rise(g, wo, n) < Expr(0.0) && Expr::input("strand") < Expr(0.5);
    p.output("normal", select(bends, bent_normal(g, wo, n), n));
  });
}
NodeProgram record_raise() {
  return recorded([](Program& p) { p.output("wo", raise_to_horizon(input3("wo"))); });
}
LampSlot<Expr> slot_input() { return {input3("place"), input3("turn"), input3("scale"), input3("shape")}; }
LampAxes<Expr> axes_input() {
  return {input3("across"), input3("along"), input3("away"), Expr::input("half_across"), Expr::input("half_along")};
}
NodeProgram record_axes() {
  return recorded([](Program& p) {
    const LampAxes<Expr> axes = lamp_axes(slot_input());
    p.output("across", axes.across);
    p.output("along", axes.along);
    p.output("away", axes.away);
    p.output("half_across", axes.half_across);
    p.output("half_along", axes.half_along);
  });
}
NodeProgram record_cone() {
  return recorded([](Program& p) {
    const LampCone<Expr> cone = cone_of(slot_input(), axes_input(), input3("at"), input3("view"), input3("normal"));
    p.output("towards", cone.towards);
    p.output("drop", cone.drop);
    p.output("chord", cone.chord);
    p.output("reach", cone.reach);
    p.output("flat", cone.flat);
    p.output("used", cone.used);
    p.output("active", cone.active);
    p.output("above", cone.above);
    p.output("whole", cone.whole);
  });
}
NodeProgram record_flat() {
  return recorded([](Program& p) {
    const FlatPoint<Expr> point = flat_point(slot_input(), axes_input(), input3("at"), Expr::input("drop"),
                                             Expr::input("u_0"), Expr::input("u_1"));
    p.output("wi", point.wi);
    p.output("emphasis", point.emphasis);
  });
}
NodeProgram record_met() {
  return recorded([](Program& p) {
    LampCone<Expr> cone;
    cone.towards = input3("towards");
    cone.chord = Expr::input("chord");
    p.output("met", meets(slot_input(), axes_input(), input3("at"), cone, input3("ray")));
  });
}
NodeProgram record_lobe() {
  return recorded([](Program& p) {
    LampCone<Expr> cone;
    cone.chord = Expr::input("chord");
    cone.flat = Expr::input("flat");
    const ToonLobe<Expr> lobe = toon_lobe(cone, Expr::input("room"), Rgb<Expr>::input("value"), Expr::input("u_2"));
    p.output("color", lobe.color);
    p.output("size", lobe.size);
  });
}
/// The drawn direction's weight; `lost`: 1 where it lies in the cone of a lamp or below the surface.
NodeProgram record_rest() {
  return recorded([](Program& p) {
    const Rgb<Expr> weight = Rgb<Expr>::input("weight");
    const Expr factor = kept(max_component(weight), Expr::input("u"));
    p.output("color", weight * (factor * (Expr(1.0) - Expr::input("lost"))));
  });
}

bool is_native(ClosureKind kind) {
  return kind == ClosureKind::Diffuse || kind == ClosureKind::Reflection || kind == ClosureKind::Refraction;
}
const char* kind_of(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Diffuse:
      return "diffuse";
    case ClosureKind::DiffuseToon:
      return "cone";
    case ClosureKind::Ggx:
      return "ggx";
    case ClosureKind::Reflection:
      return "mirror";
    default:
      return "refraction";
  }
}

/// The closures that equal the model, where nodes make all of them; with choices bound.
std::optional<ClosureSum<Expr>> native_closures(const Model& model, const Brdf<Expr>& brdf) {
  std::optional<ClosureSum<Expr>> sum = brdf.exact(recorded_wo(model, brdf));
  if (!sum) return std::nullopt;
  for (const Closure<Expr>& c : *sum)
    if (!is_native(c.kind) || c.turned) return std::nullopt;
  return sum;
}

/// Closures that are nowhere above the model; with choices bound. Their sockets are outputs of the program, which reads
/// `stands`, 0 where normals are bent and Cycles would darken them, and `camera`, 1 for rays of that: Filter Glossy
/// makes facets rougher for others. Returned as the other programs have them.
ClosureSum<Expr> record_base(const Model& model, const ParamValues& fixed, const Brdf<Expr>& brdf, Program& program,
                             Json& closures) {
  const Under* of = under(model);
  if (!of || measure::two_sided(model, brdf)) return {};
  ClosureSum<Expr> sum = of->record(model.info(), fixed, input3("wo"));
  for (std::size_t i = 0; i < sum.size(); ++i) {
    Closure<Expr>& c = sum[i];
    c.weight = c.weight * Expr::input("stands");
    Json closure = {{"kind", kind_of(c.kind)}, {"weight", fmt::format("weight_{}", i)}};
    if (has_facets(c.kind)) {
      c.weight = c.weight * Expr::input("camera");
      closure["roughness"] = fmt::format("roughness_{}", i);
      program.output(closure["roughness"], sqrt(c.alpha));
    }
    if (has_cone(c.kind)) {
      closure["size"] = fmt::format("size_{}", i);
      closure["smooth"] = fmt::format("smooth_{}", i);
    }
    closures.push_back(closure);
  }
  output_closures(sum, program);
  return input_closures(sum);
}

ParamValues default_choices(const ModelInfo& info) {
  ParamValues out;
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Choice) out[p.name] = p.choices[std::size_t(p.value[0])];
  return out;
}

bool has_native_closures(const Model& model, const ParamValues& values) {
  Recorder recorder;
  return native_closures(model, *model.record(values)).has_value();
}

class Nodes final : public Form {
 public:
  Nodes() : Form("nodes") {}

  When when() const override { return When::Asked; }
  bool in_whole_pack(const Model& model) const override { return !why_not(model, default_choices(model.info())); }
  bool draws() const override { return true; }
  bool native() const override { return true; }
  /// One combination of choices, so that a group has one tree.
  ParamValues values(const Model& model, const ParamValues& fixed) const override {
    ParamValues out = default_choices(model.info());
    for (auto& [name, value] : out)
      if (const auto it = fixed.find(name); it != fixed.end()) value = it->second;
    return out;
  }
  std::optional<std::string> why_not(const Model& model, const ParamValues& fixed) const override {
    const ParamValues bound = values(model, fixed);
    Recorder recorder;
    if (model.has_scatter() && measure::two_sided(model, *model.record(bound)) && !has_native_closures(model, bound))
      return "Blender's nodes can't send rays through a surface in a direction of their own";
    return std::nullopt;
  }

  FormError error(const Model& model, const Setting&) const override { return error_of_samples(model); }
  std::vector<std::string> warnings(const Model& model, const Shader&) const override {
    std::vector<std::string> codes = {"clamp_indirect", "clamp_direct", "orthographic_far", "normal_pass"};
    if (model.has_mirror()) codes.insert(codes.end(), {"multiple_importance", "filter_glossy", "clamp_mirror"});
    return codes;
  }
  bool highlights(const Model& model, const Shader&) const override { return !model.has_mirror(); }
  Shader write(const Model& model, const measure::AlbedoTable&, const Setting& setting) const override {
    ParamValues fixed = setting.fixed;
    fixed.merge(default_choices(model.info()));
    return write_nodes(model, fixed, setting.max_lamps);
  }

 private:
  /// `fixed` has every choice.
  static Shader write_nodes(const Model&, const ParamValues& fixed, int max_lamps);
};

Shader Nodes::write_nodes(const Model& model, const ParamValues& fixed, int max_lamps) {
  Shader out;
  out.name = fmt::format("brdfc_{}_nodes", model.info().name);
  Json parts = Json::object(), bounds = Json::object(), closures = Json::array(), under_closures = Json::array();
  const auto add = [&](const char* name, const NodeProgram& program) {
    parts[name] = json_of(program);
    out.operations += int(program.operations.size());
  };
  for (const ParamInfo& p : model.info().params)
    if (p.kind == ParamKind::Number && !fixed.count(p.name)) bounds[p.name] = {p.min, p.max};
  if (model.info().look != Look::Matte) add("bend", record_bend());
  add("raise", record_raise());
  bool lamps = false;
  {
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
    if (std::optional<ClosureSum<Expr>> sum = native_closures(model, *brdf)) {
      Program program;
      for (std::size_t i = 0; i < sum->size(); ++i) {
        Closure<Expr>& c = (*sum)[i];
        if (model.has_medium()) c.weight = c.weight * medium(*brdf, Expr::input("side"), Expr::input("path_length"));
        const std::string weight = fmt::format("weight_{}", i), ior = fmt::format("ior_{}", i);
        program.output(weight, c.weight);
        Json closure = {{"kind", kind_of(c.kind)}, {"weight", weight}};
        if (c.kind == ClosureKind::Refraction) {
          program.output(ior, c.ior);
          closure["ior"] = ior;
        }
        closures.push_back(closure);
      }
      add("closures", print::node_program(program, kVectors));
    } else {
      lamps = max_lamps > 0;
      const Vec3<Expr> wo = input3("wo"), wi = input3("wi");
      Program of_base;
      const ClosureSum<Expr> base = record_base(model, fixed, *brdf, of_base, under_closures);
      if (!base.empty()) add("base", print::node_program(of_base, kVectors));
      {
        Program program;
        const Rgb<Expr> f = brdf->eval(wi, wo) * abs(wi.z);
        program.output("value", base.empty() ? f : f - evaluate(base, wi, wo));
        const print::NodePrograms made = print::node_programs(program, {"wi_x", "wi_y", "wi_z"}, "kept_", kVectors);
        add("once", made.once);
        add("value", made.each);
      }
      {
        Program program;
        const Under* of = base.empty() ? nullptr : under(model);
        const Sample<Expr> s = of && of->sample
                                   ? of->sample(model.info(), fixed, wo, recorded_u(), Expr::input("stands"))
                                   : brdf->sample(wo, recorded_u());
        program.output("wi", s.wi);
        program.output("weight", base.empty() ? s.weight : s.weight - evaluate(base, s.wi, wo) / s.pdf);
        add("draw", print::node_program(program, kVectors));
      }
      if (model.has_mirror()) {
        Program program;
        program.output("weight_0", brdf->mirror(wo));
        add("closures", print::node_program(program, kVectors));
        closures.push_back({{"kind", "mirror"}, {"weight", "weight_0"}});
      }
    }
  }
  if (parts.contains("draw")) add("rest", record_rest());
  if (lamps) {
    add("axes", record_axes());
    add("cone", record_cone());
    add("flat", record_flat());
    add("met", record_met());
    add("lobe", record_lobe());
    out.lamps = max_lamps;
  }
  out.closures = int(closures.size()) + int(under_closures.size()) + int(parts.contains("draw")) + out.lamps;
  // Of the lamps' the extension takes those off that no lamp fills, by what other forms take for one.
  out.slots = out.closures - out.lamps + out.lamps * slots(ClosureKind::PhongRamp);
  out.closure_bytes = (out.closures - out.lamps) * (pool_bytes(ClosureKind::Ggx) + kPoolNode);
  out.lamp_bytes = out.lamps > 0 ? pool_bytes(ClosureKind::GlossyToon) + kPoolNode : 0;
  out.source = Json{{"format", 5},          {"isotropic", model.info().properties.isotropic},
                    {"narrow", kNarrow},    {"widest", kWidestWidened},
                    {"lamps", out.lamps},   {"bounds", bounds},
                    {"closures", closures}, {"base", under_closures},
                    {"parts", parts}}
                   .dump() +
               "\n";
  return out;
}

}  // namespace

const Form& nodes() {
  static const Nodes form;
  return form;
}

}  // namespace brdfc::forms
