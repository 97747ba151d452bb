// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in sentences.
#pragma once

#include <fmt/format.h>

#include <string>

namespace brdfc {

/// A share as a number of percent with two digits: "0.25", "12" or "100".
inline std::string in_percent(double share) {
  const std::string text = fmt::format("{:.2g}", 100 * share);
  return text.find("e+") == std::string::npos ? text : fmt::format("{:.0f}", 100 * share);
}

}  // namespace brdfc
