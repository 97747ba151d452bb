// SPDX-License-Identifier: GPL-3.0-or-later
// Formatting of text and numbers for the report page.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <optional>
#include <string>

namespace brdfc::report {

/// Appends formatted text.
template <class... Args> void put(std::string& out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
}

inline std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  return out;
}

inline constexpr const char* kMinus = "\xe2\x88\x92";
inline constexpr const char* kDash = "\xe2\x80\x93";

inline std::string with_minus(std::string text) {
  if (!text.empty() && text.front() == '-') text.replace(0, 1, kMinus);
  return text;
}

/// 0.00123 -> 1.2·10^−3
inline std::string scientific(double v) {
  if (v == 0) return "0";
  int exponent = int(std::floor(std::log10(std::abs(v))));
  std::string mantissa = fmt::format("{:.1f}", v / std::pow(10, exponent));
  if (mantissa == "10.0" || mantissa == "-10.0") {  // 9.96 rounds up into the next decade
    ++exponent;
    mantissa = fmt::format("{:.1f}", v / std::pow(10, exponent));
  }
  return fmt::format(
      "{}\xc2\xb7"
      "10<sup>{}</sup>",
      with_minus(mantissa), with_minus(std::to_string(exponent)));
}

template <class T> std::string or_dash(const std::optional<T>& v, const std::string& text) { return v ? text : kDash; }

}  // namespace brdfc::report
