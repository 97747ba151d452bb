// SPDX-License-Identifier: GPL-3.0-or-later
// JSON as text. nlohmann's parser and writer are left to one source: each that calls them compiles them anew.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace brdfc::inline core {

/// Throws what nlohmann's parse() throws.
nlohmann::json json_of_text(const std::string&);
/// The text on one line, or with that many spaces for each level.
std::string json_text(const nlohmann::json&, int indent = -1);
std::string json_text(const nlohmann::ordered_json&, int indent = -1);

}  // namespace brdfc::inline core
