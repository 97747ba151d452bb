// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers in a long text, separated by spaces or commas, and braces around them.
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "core/error.h"

namespace brdfc::measured {

class NumberText {
 public:
  /// `where` names the text in messages.
  NumberText(std::string_view text, std::string where) : rest_(text), where_(std::move(where)) { skip(); }
  /// The next character that is not space; 0 at the end.
  char peek() const { return rest_.empty() ? '\0' : rest_.front(); }
  /// Whether the next character was this one, which then is left behind.
  bool take(char c) {
    if (peek() != c) return false;
    rest_.remove_prefix(1);
    skip();
    return true;
  }
  /// The next number. `place()` names it in the message if it is none.
  template <class Place> float number(const Place& place) {
    double value = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    const std::string_view word = rest_.substr(0, rest_.find_first_of(" \t\r\n,{}"));
    // A number that a float can't hold as something else than 0 is 0.
    const bool is_number = error == std::errc() && end == rest_.data() + word.size();
    if (!is_number || !(std::abs(value) <= kLargest))
      input_error("{}: {}: expected a finite number up to {:g}, got '{:.30}'", where_, place(), kLargest, word);
    rest_.remove_prefix(word.size());
    skip();
    return float(value);
  }
  const std::string& where() const { return where_; }
  /// What follows in the line, shortened, for messages.
  std::string_view rest() const { return rest_.substr(0, rest_.find_first_of("\r\n\t\v\f")).substr(0, 30); }

  static constexpr double kLargest = 1e30;

 private:
  void skip() { rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n,"), rest_.size())); }

  std::string_view rest_;
  std::string where_;
};

}  // namespace brdfc::measured
