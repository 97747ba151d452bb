// SPDX-License-Identifier: GPL-3.0-or-later
// Storage for results that take long to compute: fits and tables of albedos.
//
// A result is stored in a file whose name contains a hash of everything that the result depends on. Results that belong
// to the repository are data/KIND/MODEL_HASH.exr in the tool's data. Results for other models and parameters are
// KIND/MODEL_HASH.exr in the user's cache (core/data_dir.h). If there is no file with the current hash, the result is
// computed and stored in the cache, and a line on stderr says so.
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

/// All members of a struct of settings as words, for a key, so that none can be forgotten. Every member must have 8
/// bytes, as double and std::size_t have. Padding, whose bytes could differ between machines, does not compile.
template <class Settings> constexpr auto words_of(const Settings& settings) {
  static_assert(std::is_trivially_copyable_v<Settings> && alignof(Settings) == 8);
  return std::bit_cast<std::array<std::uint64_t, sizeof(Settings) / 8>>(settings);
}

/// Everything that a stored result depends on.
class StoreKey {
 public:
  /// `kind` is the name of the folder, such as "fits" or "albedos".
  StoreKey(std::string kind, std::string model) : kind_(std::move(kind)), model_(std::move(model)) {}

  /// Adds a part to the key. The order of parts matters.
  StoreKey& add(const std::string& name, const std::string& value);
  /// Adds all members of a struct of settings to the key.
  template <class Settings> StoreKey& add_settings(const Settings& settings) {
    for (const std::uint64_t word : words_of(settings)) add("setting", std::to_string(word));
    return *this;
  }

  const std::string& model() const { return model_; }
  /// The hash, as 64 hexadecimal digits.
  std::string hash() const;
  /// The file data/KIND/MODEL_HASH.exr, with the first 16 digits of the hash, whether or not it exists. Throws
  /// InputError if the tool's data are not found.
  std::filesystem::path path() const;
  /// The file KIND/MODEL_HASH.exr in the user's cache; nullopt if there is no cache.
  std::optional<std::filesystem::path> cached_path() const;

 private:
  std::string kind_, model_, text_;
};

/// The file for a key in the tool's data, if it exists.
std::optional<std::filesystem::path> find_stored(const StoreKey&);
/// The file for a key in the user's cache, if it exists. The file is marked as used, so that it will be among the last
/// to be removed.
std::optional<std::filesystem::path> find_cached(const StoreKey&);
/// Writes the file for a key into the user's cache, atomically. Of the files of this model and kind, only the 16 that
/// were used last are kept. If the file can't be written, prints a line on stderr and returns nullopt; the next run
/// then computes the result again.
std::optional<std::filesystem::path> cache(const StoreKey&,
                                           const std::function<void(const std::filesystem::path&)>& write);
/// Prints on stderr that `what` is not stored and is being computed, which takes `how_long`.
void announce_making(const StoreKey&, const std::string& what, const std::string& how_long);

/// Returns the stored result for a key, by read(path). If there is none, computes it with make(), stores it in the
/// cache with write(result, path) and reads it back, so that every run gets the same numbers. `what` and `how_long` are
/// passed to announce_making(); if `what` is empty, nothing is printed. An unreadable file is an error in the tool's
/// data; in the cache it is computed again.
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

/// Writes the file for a key into the tool's data, and removes the files of the same model and kind with other hashes.
/// Throws InputError that names the folder if it can't be created.
void replace_stored(const StoreKey&, const std::function<void(const std::filesystem::path&)>& write);

}  // namespace brdfc::inline tables
