// SPDX-License-Identifier: GPL-3.0-or-later
// Strict reading of JSON. Every error names the file, the key and what was expected.
#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace brdfc::reference {

/// Reads a file. Throws InputError for a missing file, bad syntax (with line and column), a key that occurs twice in an
/// object, a number that does not fit into double, and nesting deeper than 32 levels.
nlohmann::json read_json(const std::filesystem::path& path);
/// Parses a text in the same way. Messages call it `name`.
nlohmann::json parse_json(std::string_view text, const std::string& name);

/// A value in a JSON file, with its place in the file. The view must not outlive the JSON.
class JsonView {
 public:
  JsonView(const nlohmann::json& value, std::string file, std::string key = "")
      : value_(&value), file_(std::move(file)), key_(std::move(key)) {}

  const nlohmann::json& json() const { return *value_; }
  const std::string& key() const { return key_; }

  /// The value for a message, shortened.
  std::string found() const;
  /// Throws InputError "<file>: <key>: expected <expected>, found <value>".
  [[noreturn]] void fail(const std::string& expected) const;
  /// Throws InputError "<file>: <key>: <message>".
  [[noreturn]] void error(const std::string& message) const;

  /// Throws unless the value is an object without other keys than these.
  void only(const std::vector<std::string>& keys) const;
  bool has(const std::string& key) const { return value_->is_object() && value_->contains(key); }
  /// The member with this key, which is required.
  JsonView at(const std::string& key) const;
  std::optional<JsonView> find(const std::string& key) const;
  /// Elements of an array.
  std::vector<JsonView> elements() const;
  /// Members of an object, by name.
  std::vector<std::pair<std::string, JsonView>> members() const;

  /// A number in [min, max].
  double number(double min, double max) const;
  /// A whole number in [min, max].
  int integer(int min, int max) const;
  bool boolean() const;
  /// A string that is not empty.
  std::string text() const;
  /// A string that is one of `choices`.
  std::string choice(const std::vector<std::string>& choices) const;
  /// An array of N numbers in [min, max].
  template <std::size_t N> std::array<double, N> numbers(double min, double max) const {
    if (!value_->is_array() || value_->size() != N) fail(std::to_string(N) + " numbers");
    std::array<double, N> out;
    const auto list = elements();
    for (std::size_t i = 0; i < N; ++i) out[i] = list[i].number(min, max);
    return out;
  }

 private:
  JsonView child(const nlohmann::json& value, const std::string& key) const;

  const nlohmann::json* value_;
  std::string file_, key_;
};

}  // namespace brdfc::reference
