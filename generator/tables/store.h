// SPDX-License-Identifier: GPL-3.0-or-later
// The store of results that take long to make: fits and tables of albedos.
//
// A result is kept by a hash of all that it depends on: those that belong to the repository as data/KIND/MODEL_HASH.exr
// in the tool's data, those of other models and parameters as KIND/MODEL_HASH.exr in the user's cache
// (core/data_dir.h). Where the hash of today has no file, the result is made, a line on stderr says so, and it goes
// into the cache.
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

#include "core/error.h"

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
  /// KIND/MODEL_HASH.exr in the user's cache; none where there is no cache.
  std::optional<std::filesystem::path> cached_path() const;

 private:
  std::string kind_, model_, text_;
};

/// The file of a key in the tool's data, if there is one.
std::optional<std::filesystem::path> find_stored(const StoreKey&);
/// The same in the user's cache. It counts as used, so that it is among the last to go.
std::optional<std::filesystem::path> find_cached(const StoreKey&);
/// Writes a file of a key into the user's cache, in one step, and removes the ones of this model and kind that were
/// used longest ago, all but 16. Nothing, and a line on stderr, if it can't be written: then the next run makes it
/// again.
std::optional<std::filesystem::path> cache(const StoreKey&,
                                           const std::function<void(const std::filesystem::path&)>& write);
/// Says on stderr that `what` is not stored and is made, which takes `how_long`.
void announce_making(const StoreKey&, const std::string& what, const std::string& how_long);

/// What is kept by a key, by read(path); else what make() gives, which is kept in the cache by write(result, path) and
/// read from there, so that every run has the same numbers. `what` and `how_long` as in announce_making(); nothing is
/// said if `what` is empty. What can't be read is an error in the tool's data, and made anew in the cache.
template <class Read, class Make, class Write> auto kept_or_made(const StoreKey& key, const std::string& what,
                                                                 const std::string& how_long, const Read& read,
                                                                 const Make& make, const Write& write) {
  if (const auto path = find_stored(key)) return read(*path);
  if (const auto path = find_cached(key)) {
    try {
      return read(*path);
    } catch (const InputError&) {
      std::error_code ignored;
      std::filesystem::remove(*path, ignored);
    }
  }
  if (!what.empty()) announce_making(key, what, how_long);
  auto made = make();
  const auto path = cache(key, [&](const std::filesystem::path& to) { write(made, to); });
  return path ? read(*path) : made;
}

/// Writes the file of a key, and removes what is kept of the model and kind by other hashes. Throws InputError naming
/// the folder if it can't be created.
void replace_stored(const StoreKey&, const std::function<void(const std::filesystem::path&)>& write);

}  // namespace brdfc::inline tables
