// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in texts.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace brdfc::inline core {

/// The number that all of the text is, which may be infinite or none; nothing if it is no number.
template <class T = double> std::optional<T> parse(std::string_view text) {
  T value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace brdfc::inline core
