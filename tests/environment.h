// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <cstdlib>
#include <optional>
#include <string>

namespace brdfc {

/// Sets an environment variable for the rest of the test, or removes it.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : Environment(name, nullptr) {
    setenv(name, value.c_str(), 1);
  }
  Environment(const char* name, std::nullptr_t) : name_(name) {
    if (const char* before = getenv(name)) before_ = before;
    unsetenv(name);
  }
  ~Environment() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }

 private:
  const char* name_;
  std::optional<std::string> before_;
};

}  // namespace brdfc
