// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace brdfc::inline core {

/// Wrong usage or input. The message names the file, the key and what was expected. Exit status 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A value that no model may return: NaN, infinite or negative. The message names the place. Exit status 1.
struct ValueError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

[[noreturn]] void throw_input_error(fmt::string_view format, fmt::format_args args);
/// Throws InputError.
template <class... Args> [[noreturn]] void input_error(fmt::format_string<Args...> format, const Args&... args) {
  throw_input_error(format, fmt::make_format_args(args...));
}

}  // namespace brdfc::inline core
