// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/json_text.h"

#include <nlohmann/json.hpp>

namespace brdfc::inline core {

nlohmann::json json_of_text(const std::string& text) { return nlohmann::json::parse(text); }
std::string json_text(const nlohmann::json& value, int indent) { return value.dump(indent); }
std::string json_text(const nlohmann::ordered_json& value, int indent) { return value.dump(indent); }

}  // namespace brdfc::inline core
