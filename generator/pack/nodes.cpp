// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/nodes.h"

#include <nlohmann/json.hpp>

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

Json by_channel(const std::vector<Rgb<double>>& values, bool grey) {
  Json channels = Json::array();
  for (int c = 0; c < (grey ? 1 : 3); ++c) {
    std::vector<float> numbers;
    for (const Rgb<double>& v : values) numbers.push_back(float(c == 0 ? v.r : c == 1 ? v.g : v.b));
    channels.push_back(numbers);
  }
  return channels;
}

std::vector<float> floats(const std::vector<double>& values) { return {values.begin(), values.end()}; }

}  // namespace

Shader write_nodes(const Model& model, const ParamValues& values) {
  const Twin& twin = twin_of(model, values);
  const bool grey = twin.tint().has_value();
  Shader out;
  out.name = fmt::format("brdfc_{}_twin", model.info().name);
  Json closures = Json::array();
  for (const TwinClosure& part : twin.parts()) {
    Json j = {{"kind", node_of(part.kind)}, {"weight", by_channel(part.weight, grey)}};
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
                    {"albedo", by_channel(twin.albedo(), grey)}}
                   .dump() +
               "\n";
  return out;
}

}  // namespace brdfc
