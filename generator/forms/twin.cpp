// SPDX-License-Identifier: GPL-3.0-or-later
// The twin: a material of Blender's own nodes, without a shader, that approximates the model along one parameter
// (fit/twin.h), or at any parameters if the model declares how (model/stand_in.h).
#include "fit/twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/json_text.h"
#include "fit/roles.h"
#include "forms/closure_nodes.h"
#include "forms/made_of_fit.h"
#include "forms/node_parts.h"
#include "model/stand_in.h"

namespace brdfc::forms {
namespace {

using Json = nlohmann::ordered_json;

/// The table in single precision, as nodes compute. One row per place of the axis; a single row without an axis.
Json rows_of(const fit::TablePtr& table) {
  const std::size_t width = std::size_t(fit::kTwinKnots), rows = table->values.size() / width;
  Json out = Json::array();
  for (std::size_t row = 0; row < rows; ++row) {
    const auto first = table->values.begin() + std::ptrdiff_t(row * width);
    out.push_back(std::vector<float>(first, first + std::ptrdiff_t(width)));
  }
  return out;
}

Json by_term(const std::vector<fit::Channels>& terms) {
  Json out = Json::array();
  for (const fit::Channels& channels : terms) {
    Json list = Json::array();
    for (const auto& table : channels) list.push_back(rows_of(table));
    out.push_back(list);
  }
  return out;
}

/// A closure that never gives more than a millionth of the light gets no node.
bool black(const fit::TwinClosure& part) {
  for (const fit::Channels& channels : part.weight)
    for (const fit::TablePtr& table : channels)
      if (std::ranges::any_of(table->values, [](double x) { return x > 1e-6; })) return false;
  return true;
}

/// For each term a list of [factor, powers of the parameters], to be summed.
Json polynomials(const fit::Terms& terms) {
  Json out = Json::array();
  for (const fit::Terms::Term& term : terms.terms) {
    Json sum = Json::array();
    for (const auto& [powers, times] : term.polynomial) sum.push_back({times, powers});
    if (terms.parameters.empty()) sum = Json::array({Json::array({1, Json::array()})});
    out.push_back(sum);
  }
  return out;
}

class Twin final : public Form {
 public:
  Twin() : Form("twin") {}

  When when() const override { return When::Asked; }
  bool in_whole_pack(const Model& model) const override {
    return stand_in(model) || !fit::unfit(model, values_of_fit(model, {}));
  }
  bool made_of_fit() const override { return true; }
  bool serves(const Model& model, fit::Role role) const override { return stand_in(model) || role != fit::Role::Open; }
  ParamValues values(const Model& model, const ParamValues& fixed) const override {
    return stand_in(model) ? ParamValues{} : values_of_fit(model, fixed);
  }
  std::optional<std::string> why_not(const Model& model, const ParamValues& fixed) const override {
    return stand_in(model) ? std::nullopt : fit::unfit(model, fixed);
  }

  bool native() const override { return true; }
  FormError error(const Model& model, const Setting& setting) const override {
    if (stand_in(model)) return error_of_stand_in(model, setting.fixed);
    const fit::Twin& twin = fit::twin_of(model, setting.fixed);
    return error_of_fit(twin.errors(), "Blender's nodes fitted to the model", twin.axis());
  }
  std::optional<fit::FitAxis> axis(const Model& model, const Setting& setting) const override {
    return stand_in(model) ? std::nullopt : fit::twin_of(model, setting.fixed).axis();
  }
  void prepare(const Model& model, const Setting& setting) const override {
    if (!stand_in(model)) fit::twin_of(model, setting.fixed);
  }

  Shader write(const Model&, const measure::AlbedoTable&, const Setting& = {}) const override;
  std::vector<std::string> warnings(const Model& model, const Shader&) const override {
    // It consists of a Diffuse node, Glossy nodes with tilted normals, and a mirror.
    if (stand_in(model)) return {"caustics", "filter_glossy"};
    if (!model.has_mirror()) return {"leaning_facets", "caustics", "filter_glossy"};
    return {"multiple_importance", "leaning_facets", "caustics", "filter_glossy", "clamp_mirror"};
  }
  bool highlights(const Model& model, const Shader&) const override { return !model.has_mirror(); }
};

/// `source` is JSON that describes the nodes' inputs. Tables (fit/twin.h) run over the cosine of the view, evenly
/// spaced from 0 to 1, with one row for each evenly spaced place of `axis`; `axis` is null if there is only one row.
/// `closures` has the kind and the tables of each closure: `weight` and `albedo` by term and channel, with a single
/// channel if `tint` multiplies it. `terms` says how the `mixed` parameters give the weights of the terms,
/// `mirror_terms` the same for a mirror. Factors multiply all weights except a mirror's.
Shader Twin::write(const Model& model, const measure::AlbedoTable&, const Setting& setting) const {
  if (stand_in(model)) return write_closures(model, setting);
  const fit::Twin& twin = fit::twin_of(model, setting.fixed);
  Shader out;
  out.name = fmt::format("brdfc_{}_twin", model.info().name);
  Json closures = Json::array();
  for (const fit::TwinClosure& part : twin.parts()) {
    if (black(part)) continue;
    Json j = {{"kind", kind_of(part.kind)}, {"weight", by_term(part.weight)}};
    if (has_facets(part.kind)) {
      j["lean"] = rows_of(part.lean);
      j["roughness"] = rows_of(part.roughness);
      j["spread"] = rows_of(part.spread);
    }
    closures.push_back(j);
    out.closures += has_facets(part.kind) ? 2 : 1;
  }
  out.slots = out.closures;
  const Rgb<double> tint = twin.tint().value_or(Rgb<double>(1.0));
  const std::optional<fit::FitAxis>& axis = twin.axis();
  const Json over = axis ? Json{{"parameter", axis->parameter},
                                {"low", axis->low},
                                {"high", axis->high},
                                {"scale", name_of(axis->scale)}}
                         : Json();
  const Json source{{"format", 2},
                    {"axis", over},
                    {"mixed", twin.terms().parameters},
                    {"terms", polynomials(twin.terms())},
                    {"mirror_terms", model.has_mirror() ? polynomials(twin.mirror_terms()) : Json::array()},
                    {"tint", {tint.r, tint.g, tint.b}},
                    {"closures", closures},
                    {"albedo", by_term(twin.albedo())}};
  out.source = json_text(source) + "\n";
  return out;
}

}  // namespace

const Form& twin() {
  static const Twin form;
  return form;
}

}  // namespace brdfc::forms
