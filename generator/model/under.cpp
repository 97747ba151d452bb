// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/under.h"

#include <map>

namespace brdfc::inline model {
namespace {

/// By the names of models.
std::map<std::string, Under>& all() {
  static std::map<std::string, Under> known;
  return known;
}

}  // namespace

const Under* under(const Model& model) {
  const auto it = all().find(model.info().name);
  return it == all().end() ? nullptr : &it->second;
}

bool register_under(const std::string& name, const Under& closures) { return all().emplace(name, closures).second; }

}  // namespace brdfc::inline model
