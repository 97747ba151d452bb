// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/nodes.h"

#include <nlohmann/json.hpp>

#include "represent/fit.h"
#include "represent/twin.h"

namespace brdfc {
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

Json by_channel(const Channels& tables) {
  Json channels = Json::array();
  for (const auto& table : tables) channels.push_back(floats(table));
  return channels;
}

}  // namespace

Shader write_nodes(const Model& model, const ParamValues& fixed) {
  const Twin& twin = twin_of(model, without_factors(model, fixed));
  Shader out;
  out.name = fmt::format("brdfc_{}_twin", model.info().name);
  Json closures = Json::array();
  for (const TwinClosure& part : twin.parts()) {
    Json j = {{"kind", node_of(part.kind)}, {"weight", by_channel(part.weight)}};
    if (has_facets(part.kind)) {
      j["lean"] = floats(part.lean);
      j["roughness"] = floats(part.roughness);
      j["spread"] = floats(part.spread);
    }
    closures.push_back(j);
    out.closures += has_facets(part.kind) ? 2 : 1;
  }
  out.slots = out.closures;
  const Rgb<double> tint = twin.tint().value_or(Rgb<double>(1.0));
  out.source = Json{{"format", 1},
                    {"tint", {tint.r, tint.g, tint.b}},
                    {"closures", closures},
                    {"albedo", by_channel(twin.albedo())}}
                   .dump() +
               "\n";
  return out;
}

}  // namespace brdfc
