// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers and lists in sentences.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <type_traits>

namespace brdfc {

/// A share as a number of percent with two digits: "0.25", "12" or "100".
inline std::string in_percent(double share) {
  const std::string text = fmt::format("{:.2g}", 100 * share);
  return text.find("e+") == std::string::npos ? text : fmt::format("{:.0f}", 100 * share);
}

/// Texts or numbers with `between` between them. fmt::join() would compile its writer of texts in every source.
template <class Range> std::string join(const Range& items, std::string_view between) {
  std::string out;
  bool first = true;
  for (const auto& item : items) {
    if (!first) out += between;
    first = false;
    if constexpr (std::is_arithmetic_v<std::decay_t<decltype(item)>>)
      out += fmt::to_string(item);
    else
      out += std::string_view(item);
  }
  return out;
}

}  // namespace brdfc
