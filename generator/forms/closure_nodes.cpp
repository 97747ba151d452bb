// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/closure_nodes.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

#include "core/json_text.h"
#include "forms/made_of_fit.h"
#include "forms/node_choices.h"
#include "forms/node_parts.h"
#include "model/stand_in.h"
#include "print/node_program.h"

namespace brdfc::forms {
namespace {

using Json = nlohmann::ordered_json;

/// Adds a closure's inputs to the outputs of the program; returns their names, and the kind.
Json record_closure(const Closure<Expr>& c, std::size_t index, Program& program) {
  if (c.turned || c.metal || c.stretched != Tangent::None || (c.kind != ClosureKind::Diffuse && !has_facets(c.kind)))
    throw std::logic_error("a stand-in has a closure that EEVEE lacks");
  const std::string weight = fmt::format("weight_{}", index), roughness = fmt::format("roughness_{}", index);
  program.output(weight, c.weight);
  Json closure = {{"kind", kind_of(c.kind)}, {"weight", weight}};
  if (has_facets(c.kind)) {
    program.output(roughness, sqrt(c.alpha));
    closure["roughness"] = roughness;
  }
  return closure;
}

}  // namespace

Shader write_closures(const Model& model, const Setting& setting) {
  const ModelInfo& info = model.info();
  Recorder recorder;
  std::vector<Program> programs;
  Json closures;
  for (const ParamValues& values : open_combinations(info, setting.fixed)) {
    closures = Json::array();
    Program& program = programs.emplace_back();
    const ClosureSum<Expr> sum = stand_in(model)->record(info, values, input3("wo"));
    Rgb<Expr> albedo(Expr(0.0));
    for (std::size_t i = 0; i < sum.size(); ++i) {
      closures.push_back(record_closure(sum[i], i, program));
      albedo += has_facets(sum[i].kind)
                    ? sum[i].weight * facet_albedo(sum[i].alpha, maximum(Expr::input("wo_z"), Expr(0.0)))
                    : sum[i].weight;
    }
    program.output("albedo", albedo);
  }
  const print::NodeProgram made = print::node_program(selected_by_choices(info, setting.fixed, programs), {});
  Shader out;
  out.name = fmt::format("brdfc_{}_twin", info.name);
  out.closures = out.slots = int(closures.size());
  out.operations = int(made.operations.size());
  const Json source{{"format", 1},
                    {"bounds", bounds_json(info, setting.fixed)},
                    {"closures", closures},
                    {"parts", {{"closures", json_of(made)}}}};
  out.source = json_text(source) + "\n";
  return out;
}

std::vector<fit::ViewError> stand_in_errors(const Model& model, const ParamValues& values) {
  return fit::view_errors(measure::bind_model(model, values),
                          [&](const Vec3<double>& wo) { return stand_in(model)->bound(model.info(), values, wo); });
}

FormError error_of_stand_in(const Model& model, const ParamValues& fixed) {
  FormError out = error_of_fit(stand_in_errors(model, fixed), "Blender's nodes, computed from the parameters");
  out.at = complete(model.info(), {});
  for (const auto& [name, value] : fixed) out.at.erase(name);
  if (!out.at.empty()) out.note += ", with the default parameters";
  return out;
}

}  // namespace brdfc::forms
