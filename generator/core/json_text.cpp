// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/json_text.h"

#include <nlohmann/json.hpp>

namespace brdfc::inline core {

nlohmann::json json_of_text(const std::string& text) { return nlohmann::json::parse(text); }
// Names in files of others may be no UTF-8: such bytes become U+FFFD.
std::string json_text(const nlohmann::json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::json::error_handler_t::replace);
}
std::string json_text(const nlohmann::ordered_json& value, int indent) {
  return value.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace brdfc::inline core
