// SPDX-License-Identifier: GPL-3.0-or-later
// The store of results that take long to make and are kept beside the tool: fits and tables of albedos.
//
// A result is kept as data/KIND/MODEL_HASH.exr in the tool's data (core/data_dir.h), by a hash of all that it depends
// on. Where the hash of today has no file, it is made, and a line on stderr says so.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

namespace brdfc::inline tables {

/// The members of a struct of settings as words, for a key: all of them, so that none can be left out. Members must
/// have 8 bytes each, as double and std::size_t: padding does not compile, and nothing else would be the same on all
/// machines.
template <class Settings> constexpr auto words_of(const Settings& settings) {
  static_assert(std::is_trivially_copyable_v<Settings> && alignof(Settings) == 8);
  return std::bit_cast<std::array<std::uint64_t, sizeof(Settings) / 8>>(settings);
}

/// What a kept result depends on.
class StoreKey {
 public:
  /// `kind` is the folder, "fits" or "albedos".
  StoreKey(std::string kind, std::string model) : kind_(std::move(kind)), model_(std::move(model)) {}

  /// Part of the key; order counts.
  StoreKey& add(const std::string& name, const std::string& value);
  /// All members of a struct of settings.
  template <class Settings> StoreKey& add_settings(const Settings& settings) {
    for (const std::uint64_t word : words_of(settings)) add("setting", std::to_string(word));
    return *this;
  }

  const std::string& model() const { return model_; }
  /// 64 hexadecimal digits.
  std::string hash() const;
  /// data/KIND/MODEL_HASH.exr, of the first 16 digits, whether or not it is there. Throws InputError where the tool's
  /// data are not found.
  std::filesystem::path path() const;

 private:
  std::string kind_, model_, text_;
};

/// The file of a key; nothing, and a line on stderr that `what` is made, which takes `how_long`, if there is none.
std::optional<std::filesystem::path> find_stored(const StoreKey&, const std::string& what, const std::string& how_long);

/// Writes the file of a key, and removes what is kept of the model and kind by other hashes. Throws InputError naming
/// the folder if it can't be created.
void replace_stored(const StoreKey&, const std::function<void(const std::filesystem::path&)>& write);

}  // namespace brdfc::inline tables
