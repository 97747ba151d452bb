// SPDX-License-Identifier: GPL-3.0-or-later
// The twin: no shader but Blender's own nodes, close to the model for one set of parameters (fit/twin.h).
#include "fit/twin.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "closures/closure_pool.h"
#include "fit/roles.h"
#include "forms/made_of_fit.h"

namespace brdfc::forms {
namespace {

using Json = nlohmann::ordered_json;

const char* node_of(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Ggx:
      return "ggx";
    case ClosureKind::Beckmann:
      return "beckmann";
    case ClosureKind::Diffuse:
      return "diffuse";
    case ClosureKind::Reflection:
      return "mirror";
    default:
      throw std::logic_error("a twin with a closure that no node makes");
  }
}

/// Nodes are in single precision.
std::vector<float> floats(const std::shared_ptr<const Table>& table) {
  return {table->values.begin(), table->values.end()};
}

Json by_channel(const fit::Channels& tables) {
  Json channels = Json::array();
  for (const auto& table : tables) channels.push_back(floats(table));
  return channels;
}

class Twin final : public Form {
 public:
  Twin() : Form("twin") {}

  When when() const override { return When::Asked; }
  bool in_whole_pack(const Model&) const override { return false; }
  bool made_of_fit() const override { return true; }
  bool serves(fit::Role role) const override { return role == fit::Role::Constant || role == fit::Role::Factor; }
  ParamValues values(const Model& model, const ParamValues& fixed) const override {
    return values_of_fit(model, fixed);
  }
  std::optional<std::string> why_not(const Model& model, const ParamValues& fixed) const override {
    return fit::unfit(model, fixed);
  }

  bool native() const override { return true; }
  FormError error(const Model& model, const Setting& setting) const override {
    return error_of_fit(fit::twin_of(model, setting.fixed).errors(), "Blender's nodes");
  }
  void prepare(const Model& model, const Setting& setting) const override { fit::twin_of(model, setting.fixed); }

  Shader write(const Model&, const measure::AlbedoTable&, const Setting& = {}) const override;
  std::vector<std::string> warnings(const Model& model, const Shader&) const override {
    // A matte node, glossy ones whose facets lean, and a mirror.
    if (!model.has_mirror()) return {"bump_correction", "leaning_facets", "caustics", "filter_glossy"};
    return {"bump_correction", "multiple_importance", "leaning_facets", "caustics", "filter_glossy", "clamp_mirror"};
  }
  bool highlights(const Model& model, const Shader&) const override { return !model.has_mirror(); }
};

/// `source` is JSON: what the nodes make of closures. `closures`: kind, and tables over the cosine of the view, evenly
/// spaced from 0 to 1 (fit/twin.h says what they are); `weight` and `albedo` by channel, one where `tint` multiplies
/// them. Factors multiply all but a mirror's weight.
Shader Twin::write(const Model& model, const measure::AlbedoTable&, const Setting& setting) const {
  const fit::Twin& twin = fit::twin_of(model, setting.fixed);
  Shader out;
  out.name = fmt::format("brdfc_{}_twin", model.info().name);
  Json closures = Json::array();
  for (const fit::TwinClosure& part : twin.parts()) {
    Json j = {{"kind", node_of(part.kind)}, {"weight", by_channel(part.weight)}};
    if (has_facets(part.kind)) {
      j["lean"] = floats(part.lean);
      j["roughness"] = floats(part.roughness);
      j["spread"] = floats(part.spread);
    }
    closures.push_back(j);
    const int nodes = has_facets(part.kind) ? 2 : 1;
    out.closures += nodes;
    // In Open Shading Language Blender's nodes are these closures; a mirror of theirs is facets without roughness.
    const bool glossy = part.kind != ClosureKind::Diffuse;
    out.closure_bytes += nodes * pool_bytes(glossy ? ClosureKind::Ggx : ClosureKind::Diffuse);
  }
  out.slots = out.closures;
  out.closure_bytes += std::max(out.closures - 1, 0) * kPoolNode;
  const Rgb<double> tint = twin.tint().value_or(Rgb<double>(1.0));
  out.source = Json{{"format", 1},
                    {"tint", {tint.r, tint.g, tint.b}},
                    {"closures", closures},
                    {"albedo", by_channel(twin.albedo())}}
                   .dump() +
               "\n";
  return out;
}

}  // namespace

const Form& twin() {
  static const Twin form;
  return form;
}

}  // namespace brdfc::forms
