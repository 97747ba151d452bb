// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/stand_in.h"

#include <map>

namespace brdfc::inline model {
namespace {

/// By the names of models.
std::map<std::string, StandIn>& known_stand_ins() {
  static std::map<std::string, StandIn> known;
  return known;
}

}  // namespace

const StandIn* stand_in(const Model& model) {
  const auto it = known_stand_ins().find(model.info().name);
  return it == known_stand_ins().end() ? nullptr : &it->second;
}

bool register_stand_in(const std::string& name, const StandIn& closures) {
  return known_stand_ins().emplace(name, closures).second;
}

}  // namespace brdfc::inline model
