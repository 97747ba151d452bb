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

template <class... Args> [[noreturn]] void input_error(fmt::format_string<Args...> format, Args&&... args) {
  throw InputError(fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace brdfc::inline core
