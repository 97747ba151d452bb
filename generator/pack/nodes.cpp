// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/nodes.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "closures/closure_pool.h"
#include "fit/twin.h"

namespace brdfc::pack {
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

}  // namespace

Shader write_nodes(const Model& model, const ParamValues& fixed) {
  const fit::Twin& twin = fit::twin_of(model, fixed);
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

}  // namespace brdfc::pack
