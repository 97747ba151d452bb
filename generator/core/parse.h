// SPDX-License-Identifier: GPL-3.0-or-later
// Parses numbers.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace brdfc::inline core {

/// The number that the whole text represents, which may be infinite or NaN; nullopt if the text is not a number.
template <class T = double> std::optional<T> parse(std::string_view text) {
  T value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace brdfc::inline core
