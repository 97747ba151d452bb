// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/store.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "core/data_dir.h"
#include "core/hash.h"
#include "core/write_beside.h"

namespace brdfc::inline tables {
namespace {

namespace fs = std::filesystem;

std::string file_name(const StoreKey& key) { return fmt::format("{}_{}.exr", key.model(), key.hash().substr(0, 16)); }

/// The stored files of a model with any hash. Names of models may begin alike, so exactly 16 digits must follow.
std::vector<fs::path> files_of(const fs::path& folder, const std::string& model) {
  std::vector<fs::path> out;
  std::error_code ignored;
  const std::string prefix = model + "_";
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().stem().string();
    if (name.starts_with(prefix) && name.size() == prefix.size() + 16) out.push_back(entry.path());
  }
  return out;
}

}  // namespace

StoreKey& StoreKey::add(const std::string& name, const std::string& value) {
  text_ += name + ": " + value + "\n";
  return *this;
}

std::string StoreKey::hash() const { return sha256(kind_ + "\n" + model_ + "\n" + text_); }

fs::path StoreKey::path() const { return data_path(fs::path("data") / kind_ / file_name(*this)); }

std::optional<fs::path> StoreKey::cached_path() const {
  const std::optional<fs::path> folder = cache_dir();
  return folder ? std::optional(*folder / kind_ / file_name(*this)) : std::nullopt;
}

std::optional<fs::path> find_stored(const StoreKey& key) {
  const fs::path path = key.path();
  return fs::exists(path) ? std::optional(path) : std::nullopt;
}

std::optional<fs::path> find_cached(const StoreKey& key) {
  const std::optional<fs::path> path = key.cached_path();
  std::error_code error;
  if (!path || !fs::exists(*path, error)) return std::nullopt;
  fs::last_write_time(*path, fs::file_time_type::clock::now(), error);
  return path;
}

std::optional<fs::path> cache(const StoreKey& key, const std::function<void(const fs::path&)>& write) {
  constexpr std::size_t kMost = 16;
  const std::optional<fs::path> path = key.cached_path();
  if (!path) return std::nullopt;
  const fs::path folder = path->parent_path();
  try {
    write_beside(*path, write);
  } catch (const std::exception& e) {
    fmt::print(stderr, "brdfc: it is not kept for the next time: {}\n", e.what());
    return std::nullopt;
  }
  std::error_code error;
  std::vector<std::pair<fs::file_time_type, fs::path>> kept;
  for (const fs::path& file : files_of(folder, key.model())) {
    const fs::file_time_type used = fs::last_write_time(file, error);
    if (!error && file != *path) kept.emplace_back(used, file);
  }
  std::ranges::sort(kept);
  for (std::size_t i = 0; i + kMost <= kept.size(); ++i) fs::remove(kept[i].second, error);
  return path;
}

void announce_making(const StoreKey& key, const std::string& what, const std::string& how_long) {
  const std::optional<fs::path> cached = key.cached_path();
  fmt::print(stderr, "brdfc: no {} in {}{}: making it, which takes {}\n", what, key.path().parent_path().string(),
             cached ? " or " + cached->parent_path().string() : "", how_long);
}

void replace_stored(const StoreKey& key, const std::function<void(const fs::path&)>& write) {
  const fs::path path = key.path(), folder = path.parent_path();
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) input_error("{}: cannot be created: {}", folder.string(), error.message());
  write(path);
  for (const fs::path& file : files_of(folder, key.model()))
    if (file != path) fs::remove(file);
}

}  // namespace brdfc::inline tables
