// SPDX-License-Identifier: GPL-3.0-or-later
// Command-line options that are numbers. Each must be finite and in a range; otherwise the error names the option, what
// was expected and what was given. All numbers of the command line are read here.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "app/commands.h"
#include "core/parse.h"

namespace brdfc::app {

template <class N>
concept OptionNumber = std::integral<N> || std::floating_point<N>;

/// The range of numbers that an option accepts; by default all finite ones.
template <OptionNumber N> struct Accepted {
  N low = std::numeric_limits<N>::lowest(), high = std::numeric_limits<N>::max();
  bool above_low = false;     ///< `low` itself is excluded
  char unit = 0;              ///< which may follow the number
  std::string in_words = {};  ///< replaces the range in messages, for example "a positive number"

  std::string text() const {
    if (!in_words.empty()) return in_words;
    const std::string kind = std::integral<N> ? "a whole number" : "a number";
    if (low == std::numeric_limits<N>::lowest() && high == std::numeric_limits<N>::max()) return kind;
    if (high == std::numeric_limits<N>::max()) return fmt::format("{} {} {}", kind, above_low ? "above" : "from", low);
    return fmt::format("{} in {}{}, {}]", kind, above_low ? '(' : '[', low, high);
  }
};

/// Converts the whole text to a number. Refuses any other text with a message that names the option.
template <OptionNumber N>
N accepted_number(const std::string& option, std::string_view text, const Accepted<N>& range) {
  const bool has_unit = range.unit != 0 && text.ends_with(range.unit);
  const std::optional<N> number = parse<N>(text.substr(0, text.size() - has_unit));
  const bool finite = number && std::isfinite(double(*number));
  if (!finite || !(*number >= range.low && *number <= range.high) || (range.above_low && *number == range.low)) {
    const bool too_long =
        std::integral<N> && !number && text.find_first_not_of("0123456789") == text.npos && !text.empty();
    const std::string most = fmt::format("{}", range.high), expected = range.text();
    refuse(option, fmt::format("expected {}{}, got '{}'", expected,
                               too_long && expected.find(most) == expected.npos ? ", at most " + most : "", text));
  }
  return *number;
}

namespace detail {

template <OptionNumber N> Option described(Option option) {
  return option.type_name(std::integral<N> ? "INTEGER" : "NUMBER");
}

}  // namespace detail

/// Adds an option that takes one number.
template <OptionNumber N> Option add_number(Command command, const std::string& name, N& value,
                                            const Accepted<N>& range, const std::string& doc) {
  Option option = command.add_option_function(
      name, [&value, name, range](const std::string& text) { value = accepted_number(name, text, range); }, doc);
  option.default_function([&value] { return fmt::format("{}", value); });
  return detail::described<N>(option);
}

/// The same for an optional number, which shows whether the option was given.
template <OptionNumber N> Option add_number(Command command, const std::string& name, std::optional<N>& value,
                                            const Accepted<N>& range, const std::string& doc) {
  return detail::described<N>(command.add_option_function(
      name, [&value, name, range](const std::string& text) { value = accepted_number(name, text, range); }, doc));
}

/// Adds an option that takes several numbers, separated by commas.
template <OptionNumber N> Option add_numbers(Command command, const std::string& name, std::vector<N>& values,
                                             const Accepted<N>& range, const std::string& doc) {
  Option option = command.add_option_function(
      name,
      [&values, name, range](const std::vector<std::string>& texts) {
        values.clear();
        for (const std::string& text : texts) values.push_back(accepted_number(name, text, range));
      },
      doc);
  return detail::described<N>(option.delimiter(','));
}

}  // namespace brdfc::app
