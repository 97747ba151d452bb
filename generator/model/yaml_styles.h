// SPDX-License-Identifier: GPL-3.0-or-later
// Values of YAML in quotes, brackets and braces, as libraries write them: strings, lists and mappings of these. This
// is no reader of YAML: the files of refractiveindex.info's database are lists of blocks, which optical_file.cpp
// reads. python/brdfc/_yaml_styles.py does the same, as Blender brings no library for YAML, and both have to agree.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace brdfc::inline model {

struct YamlValue {
  enum class Kind { Text, List, Mapping };
  Kind kind = Kind::Text;
  std::string text;
  std::vector<YamlValue> list;    ///< of a mapping: its values
  std::vector<std::string> keys;  ///< their keys
};

/// True if a text begins with a quote, a bracket or a brace.
bool is_styled(const std::string& text);

/// The number of brackets and braces that a line opens and does not close.
int unclosed(const std::string& line);

/// Whether a value that begins with a text may end in a line. `still_open`: unclosed() of all its lines.
bool may_end(const std::string& text, const std::string& line, int still_open);

/// The value that a text is; none if it needs further lines. Throws std::invalid_argument.
std::optional<YamlValue> yaml_value(const std::string& text);

/// A key at the start of a line, without its quotes, and what follows the colon; "" and the line if there is no key.
std::pair<std::string, std::string> key_and_rest(const std::string& line);

}  // namespace brdfc::inline model
