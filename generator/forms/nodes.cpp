// SPDX-License-Identifier: GPL-3.0-or-later
// The form made of nodes: a model's formulas as trees of Blender's Math nodes, which feed its Toon, Glossy and Diffuse
// nodes. It works wherever Cycles does, with and without Open Shading Language. This file writes the parts as JSON,
// from recordings; the extension's formula_nodes.py connects them.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>

#include "core/json_text.h"
#include "forms/error.h"
#include "forms/form.h"
#include "forms/node_choices.h"
#include "forms/node_lamps.h"
#include "forms/node_parts.h"
#include "measure/cubature.h"
#include "measure/probes.h"
#include "model/horizon.h"
#include "model/under.h"
#include "print/node_program.h"

namespace brdfc::forms {
namespace {

using Json = nlohmann::ordered_json;
using print::NodeProgram;

bool is_native(ClosureKind kind) {
  return kind == ClosureKind::Diffuse || kind == ClosureKind::Reflection || kind == ClosureKind::Refraction;
}

/// The closures that equal the model, if all of them exist as nodes. Choices must be bound.
std::optional<ClosureSum<Expr>> native_closures(const Model& model, const Brdf<Expr>& brdf) {
  std::optional<ClosureSum<Expr>> sum = brdf.exact(recorded_wo(model, brdf));
  if (!sum) return std::nullopt;
  for (const Closure<Expr>& c : *sum)
    if (!is_native(c.kind) || c.turned) return std::nullopt;
  return sum;
}

/// Closures that are nowhere brighter than the model. Choices must be bound. The sockets of the closures are outputs of
/// the program. The program reads `stands`, which is 0 where normals are bent and Cycles would darken matte closures.
/// The returned closures have these weights as inputs, for use in other programs. Where Filter Glossy increases the
/// roughness of facets, they keep their light, and the program's other parts remain those of the facets without it.
ClosureSum<Expr> record_base(const Model& model, const ParamValues& fixed, const Brdf<Expr>& brdf, Program& program,
                             Json& closures) {
  const Under* of = under(model);
  if (!of || measure::two_sided(model, brdf)) return {};
  ClosureSum<Expr> sum = of->record(model.info(), fixed, input3("wo"));
  ClosureSum<Expr> used;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    Closure<Expr>& c = sum[i];
    Json closure = {{"kind", kind_of(c.kind)}};
    const auto output = [&](const char* socket, const auto& value) {
      const std::string name = fmt::format("{}_{}", socket, i);
      closure[socket] = name;
      program.output(name, value);
    };
    const bool is_rough_matte = c.kind == ClosureKind::OrenNayar;  // the node has an albedo, and no weight beside it
    Rgb<Expr>& color = is_rough_matte ? c.albedo : c.weight;
    std::array<double, 3> known{1, 1, 1};
    const bool is_black = color.is_constant(&known) && known == std::array<double, 3>{};
    if (c.metal) {
      output("stands", max_component(c.weight));
      output("f0", c.f0);
      output("edge", c.edge);
      // As Blender's Metallic BSDF has it: with r its squared Roughness and q = 1 - 0.9 anisotropy, alpha is r /
      // sqrt(q) along the tangent and r sqrt(q) across it. A rotation of 0.25 is a right angle.
      const Expr large = maximum(c.alpha, c.alpha_across), small = minimum(c.alpha, c.alpha_across);
      output("roughness", sqrt(sqrt(large * small)));
      output("anisotropy", (Expr(1) - small / large) * Expr(1 / (1 - kLeastAspect)));
      output("rotation", select(c.alpha < c.alpha_across, Expr(0.25), Expr(0)));
    }
    // Facets are not matte, so bent normals do not darken them.
    if (!c.metal) output("weight", has_facets(c.kind) ? color : color * Expr::input("stands"));
    if (is_rough_matte) output("roughness", c.roughness);
    if (has_facets(c.kind) && !c.metal) {
      // Cycles keeps a node whose colour is black, and what its other inputs need.
      if (has_whole(model)) output("stands", select(Expr(0) < max_component(color), Expr(1), Expr(0)));
      // As Blender's Glossy node has it: with r its squared Roughness, alpha is r (1 - anisotropy) along the tangent
      // and r / (1 - anisotropy) across it, or r / (1 + anisotropy) and r (1 + anisotropy) if it is negative.
      const bool is_stretched = c.stretched != Tangent::None;
      const Expr mean = is_stretched ? sqrt(c.alpha * c.alpha_across) : c.alpha;
      output("roughness", sqrt(mean));
      if (is_stretched)
        output("anisotropy",
               select(c.alpha < c.alpha_across, Expr(1) - c.alpha / mean, c.alpha_across / mean - Expr(1)));
      if (c.stretched == Tangent::View) closure["along"] = "view";
    }
    if (has_cone(c.kind)) {
      output("size", c.size);
      output("smooth", c.smooth);
    }
    closures.push_back(closure);
    if (is_black) continue;
    color = c.metal ? Rgb<Expr>(Expr::input(closure["stands"])) : Rgb<Expr>::input(closure["weight"]);
    if (c.metal) {
      c.f0 = Rgb<Expr>::input(closure["f0"]);
      c.edge = Rgb<Expr>::input(closure["edge"]);
    }
    used.push_back(c);
  }
  return used;
}

ParamValues default_choices(const ModelInfo& info) {
  ParamValues out;
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Choice) out[p.name] = p.choices[std::size_t(p.value[0])];
  return out;
}

/// The programs that a model contributes to the parts, for one combination of choices.
struct NodeRecording {
  bool native = false;     ///< Blender's closures equal the whole model
  Json closures, of_base;  ///< kinds of closures, and the names of their inputs
  Program give;            ///< computes the inputs of `closures`
  Program whole;           ///< computes `others`: 0 where the base is all of the model, otherwise 1
  bool facets = false;     ///< whether the base has facets
  Program base;            ///< computes the inputs of `of_base`
  /// f cos - base and its density; a direction that is drawn, and its weight if that is not the quotient of both.
  Program sampled;
};

/// Uses the current recorder; `fixed` must contain every choice.
NodeRecording record_nodes(const Model& model, const ParamValues& fixed) {
  NodeRecording out{.native = false,
                    .closures = Json::array(),
                    .of_base = Json::array(),
                    .give = {},
                    .whole = {},
                    .base = {},
                    .sampled = {}};
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  if (std::optional<ClosureSum<Expr>> sum = native_closures(model, *brdf)) {
    out.native = true;
    for (std::size_t i = 0; i < sum->size(); ++i) {
      Closure<Expr>& c = (*sum)[i];
      if (model.has_medium()) c.weight = c.weight * medium(*brdf, Expr::input("side"), Expr::input("path_length"));
      const std::string weight = fmt::format("weight_{}", i), ior = fmt::format("ior_{}", i);
      out.give.output(weight, c.weight);
      Json closure = {{"kind", kind_of(c.kind)}, {"weight", weight}};
      if (c.kind == ClosureKind::Refraction) {
        out.give.output(ior, c.ior);
        closure["ior"] = ior;
      }
      out.closures.push_back(closure);
    }
    return out;
  }
  const Vec3<Expr> wo = input3("wo"), wi = input3("wi");
  const ClosureSum<Expr> base = record_base(model, fixed, *brdf, out.base, out.of_base);
  if (has_whole(model)) out.whole.output("others", Expr(1) - under(model)->record_whole(model.info(), fixed));
  out.facets = std::ranges::any_of(base, [](const Closure<Expr>& c) { return has_facets(c.kind); });
  const Rgb<Expr> f = brdf->eval(wi, wo) * abs(wi.z);
  const bool has_base = !out.of_base.empty();
  out.sampled.output("value", base.empty() ? f : f - evaluate(base, wi, wo));
  out.sampled.output("density", brdf->pdf(wi, wo));
  const Under* of = has_base ? under(model) : nullptr;
  if (of && of->sample) {
    const Sample<Expr> s = of->sample(model.info(), fixed, wo, recorded_u(), Expr::input("stands"));
    out.sampled.output("drawn", s.wi);
    out.sampled.output("weight", s.weight - evaluate(base, s.wi, wo) / s.pdf);
  } else {
    out.sampled.output("drawn", brdf->sample(wo, recorded_u()).wi);
  }
  if (model.has_mirror()) {
    out.give.output("weight_0", brdf->mirror(wo));
    out.closures.push_back({{"kind", "mirror"}, {"weight", "weight_0"}});
  }
  return out;
}

/// The reason, as a clause, why this form does not exist for a model with these choices.
std::optional<std::string> obstacle(const Model& model, const ParamValues& fixed) {
  Recorder recorder;
  const NodeRecording r = record_nodes(model, fixed);
  if (r.native) return std::nullopt;
  if (measure::two_sided(model, *model.record(fixed)))
    return "Blender's nodes can't send rays through a surface in a direction of their own";
  if (!print::has_nodes(r.sampled)) return "Blender's nodes have no tables of several numbers";
  return std::nullopt;
}

/// The programs for all combinations of choices that `fixed` leaves open, by name of the part.
std::vector<std::pair<const char*, NodeProgram>> record_parts(const Model& model, const ParamValues& fixed,
                                                              const std::vector<NodeRecording>& recorded) {
  std::vector<std::pair<const char*, NodeProgram>> out;
  const auto program = [&](Program NodeRecording::*part) {
    std::vector<Program> all;
    for (const NodeRecording& r : recorded) all.push_back(r.*part);
    return selected_by_choices(model.info(), fixed, all);
  };
  const auto add = [&](const char* name, Program NodeRecording::*part) {
    out.push_back({name, print::node_program(program(part), node_vectors())});
  };
  const NodeRecording& first = recorded.at(0);
  if (!first.closures.empty()) add("closures", &NodeRecording::give);
  if (first.native) return out;
  if (!first.of_base.empty()) add("base", &NodeRecording::base);
  if (has_whole(model)) add("whole", &NodeRecording::whole);
  const Program sampled = program(&NodeRecording::sampled);
  const bool weighs =
      std::ranges::any_of(sampled.outputs(), [](const auto& o) { return o.first.starts_with("weight"); });
  const std::set<std::string> varying = {"wi_x", "wi_y", "wi_z", "u_0", "u_1", "u_2"};
  const auto three = [](const std::string& name) {
    return std::set<std::string>{name, name + "_x", name + "_y", name + "_z"};
  };
  std::set<std::string> value = three("value"), draw = three("drawn");
  value.insert("density");
  draw.merge(three("weight"));
  const print::NodePrograms made =
      print::node_programs(sampled, varying, "kept_", {value, draw, {"density"}}, node_vectors());
  out.push_back({"once", made.once});
  out.push_back({"value", made.each[0]});
  out.push_back({"draw", made.each[1]});
  if (weighs) out.push_back({"density", made.each[2]});  // of the drawn direction
  return out;
}
std::vector<NodeRecording> record_combinations(const Model& model, const ParamValues& fixed) {
  std::vector<NodeRecording> out;
  for (const ParamValues& values : open_combinations(model.info(), fixed)) out.push_back(record_nodes(model, values));
  return out;
}

/// With more operations, Blender takes long to create the nodes and Cycles to compile them.
constexpr int kMostOperations = 6000;

/// See Nodes::values(); `fixed` has only choices.
ParamValues confined(const Model& model, const ParamValues& fixed) {
  const ParamValues defaults = default_choices(model.info());
  ParamValues chosen = fixed, out, all;
  chosen.merge(ParamValues(defaults));
  for (const ParamInfo& p : model.info().params) {
    if (p.kind != ParamKind::Choice || fixed.count(p.name)) continue;
    all[p.name] = defaults.at(p.name);
    for (const std::string& option : p.choices) {
      chosen[p.name] = option;
      if (obstacle(model, chosen)) out[p.name] = defaults.at(p.name);
    }
    chosen[p.name] = defaults.at(p.name);
  }
  if (out.size() == all.size()) return out;
  ParamValues left = fixed;
  left.insert(out.begin(), out.end());
  Recorder recorder;
  int operations = 0;
  for (const auto& [name, program] : record_parts(model, left, record_combinations(model, left)))
    operations += int(program.operations.size());
  return operations > kMostOperations ? all : out;
}

/// How many numbers Cycles keeps while it computes a part: those that the part needs and those in between. Where inputs
/// are many, most depend on the material's constants alone, which Cycles does not keep. The figures are above what it
/// reported for all models and lamps (tests/blender/test_closure_slots.py).
int numbers_kept(const Json& part) {
  constexpr int kVaryingInputs = 20;
  int inputs = 0;
  for (const Json& input : part.at("inputs")) inputs += input.at(1) == "VECTOR" ? 3 : 1;
  return part.at("live").get<int>() * 6 / 5 + std::min(inputs, kVaryingInputs);
}

/// What the base has in Cycles' colour passes beyond the light that it reflects: a pass has the weights of closures,
/// and cones with a ramp and facets that lose light by masking reflect less. Mean over views and colours, with the
/// parameters' defaults; 0 without a base.
double excess_in_passes(const Model& model) {
  const Under* of = under(model);
  if (!of) return 0;
  constexpr std::array kCosines = {0.2, 0.5, 0.8, 1.0};
  double excess = 0;
  for (const double cosine : kCosines) {
    const Vec3<double> wo{std::sqrt(1 - cosine * cosine), 0, cosine};
    const ClosureSum<double> base = of->bound(model.info(), {}, wo);
    const auto mean = [](const Rgb<double>& c) { return (c.r + c.g + c.b) / 3; };
    const auto reflected = [&](double height, double turn, double* out) {
      const double sine = std::sqrt(1 - height * height), phi = kPi * turn;
      *out = 2 * kPi * mean(evaluate(base, Vec3<double>{sine * std::cos(phi), sine * std::sin(phi), height}, wo));
    };
    excess -= measure::integrate(reflected, 1, {{}}, {.absolute = 1e-4}).value[0];
    for (const Closure<double>& c : base)
      excess += mean(c.kind == ClosureKind::OrenNayar ? c.weight * c.albedo
                     : c.metal                        ? c.weight * metal_fresnel(c.f0, c.edge, 1 - cosine)
                                                      : c.weight);
  }
  return excess / kCosines.size();
}

class Nodes final : public Form {
 public:
  Nodes() : Form("nodes") {}

  When when() const override { return When::Asked; }
  bool in_whole_pack(const Model& model) const override { return !why_not(model, default_choices(model.info())); }
  bool draws() const override { return true; }
  bool native() const override { return true; }
  /// Fixes choices for which nodes support only the default.
  ParamValues values(const Model& model, const ParamValues& fixed) const override {
    ParamValues choices;
    for (const ParamInfo& p : model.info().params)
      if (const auto it = fixed.find(p.name); p.kind == ParamKind::Choice && it != fixed.end()) choices.insert(*it);
    // Cached, because it requires recordings and plans ask often.
    static std::mutex lock;
    static std::map<std::pair<std::string, ParamValues>, ParamValues> known;
    const std::lock_guard guard(lock);
    const auto [it, is_new] = known.try_emplace({model.info().name, choices});
    if (is_new) it->second = confined(model, choices);
    return it->second;
  }
  std::optional<std::string> why_not(const Model& model, const ParamValues& fixed) const override {
    ParamValues chosen = fixed;
    chosen.merge(default_choices(model.info()));
    return obstacle(model, chosen);
  }

  FormError error(const Model& model, const Setting&) const override { return error_of_samples(model); }
  std::vector<std::string> warnings(const Model& model, const Shader& shader) const override {
    std::vector<std::string> codes = {"clamp_indirect", "clamp_direct", "orthographic_far", "normal_pass"};
    // Toon closures are glossy ones to Cycles, also those of matte models.
    if (shader.lamps > 0) codes.push_back("caustics");
    if (model.has_mirror()) codes.insert(codes.end(), {"multiple_importance", "clamp_mirror"});
    // Measured: at 1, Filter Glossy takes 2 to 5 % of grooves of six models with facets (of a Glossy node 12 %), and of
    // two balls on a floor of `microfacet` under a sun 3.5 %, in blocks up to 16 %.
    if (model.has_mirror() || shader.facets) codes.push_back("filter_glossy");
    if (excess_in_passes(model) > 0.02) codes.push_back("albedo_passes");
    return codes;
  }
  bool highlights(const Model& model, const Shader&) const override { return !model.has_mirror(); }
  Shader write(const Model& model, const measure::AlbedoTable&, const Setting& setting) const override {
    ParamValues fixed = setting.fixed;
    fixed.merge(values(model, fixed));
    return write_nodes(model, fixed, setting.max_lamps);
  }

 private:
  static Shader write_nodes(const Model&, const ParamValues& fixed, int max_lamps);
};

Shader Nodes::write_nodes(const Model& model, const ParamValues& fixed, int max_lamps) {
  Shader out;
  out.name = fmt::format("brdfc_{}_nodes", model.info().name);
  Json parts = Json::object();
  const auto add = [&](const char* name, const NodeProgram& program) {
    parts[name] = json_of(program);
    out.operations += int(program.operations.size());
  };
  if (model.info().look != Look::Matte) add("bend", record_bend());
  add("raise", record_raise());
  Recorder recorder;
  const std::vector<NodeRecording> recorded = record_combinations(model, fixed);
  const NodeRecording& first = recorded.at(0);
  for (const auto& [name, program] : record_parts(model, fixed, recorded)) add(name, program);
  const bool lamps = !first.native && max_lamps > 0;
  if (parts.contains("draw")) add("rest", record_rest());
  if (lamps) {
    add("axes", record_axes());
    add("cone", record_cone());
    add("lit", record_lit());
    add("count", record_count());
    add("cone_at", record_cone_at());
    add("aside", record_aside());
    add("flat", record_flat());
    add("beam", record_beam());
    add("met", record_met());
    add("lobe", record_lobe());
    out.lamps = max_lamps;
    out.numbers = numbers_kept(parts.at("value"));
  }
  out.facets = first.facets;
  out.closures = int(first.closures.size() + first.of_base.size()) + int(parts.contains("draw")) + out.lamps;
  // The extension subtracts the slots of lamps that are not in use, with the count per lamp that other forms have.
  out.slots = out.closures - out.lamps + out.lamps * slots(ClosureKind::PhongRamp);
  const Json source{{"format", 5},
                    {"isotropic", model.info().properties.isotropic},
                    {"narrow", kNarrow},
                    {"widest", kWidestWidened},
                    {"lamps", out.lamps},
                    {"bounds", bounds_json(model.info(), fixed)},
                    {"closures", first.closures},
                    {"base", first.of_base},
                    {"parts", parts}};
  out.source = json_text(source) + "\n";
  return out;
}

}  // namespace

const Form& nodes() {
  static const Nodes form;
  return form;
}

}  // namespace brdfc::forms
