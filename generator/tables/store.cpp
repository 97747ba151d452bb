// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/store.h"

#include <fmt/format.h>

#include <cstdio>

#include "core/data_dir.h"
#include "core/error.h"
#include "core/hash.h"

namespace brdfc::inline tables {

StoreKey& StoreKey::add(const std::string& name, const std::string& value) {
  text_ += name + ": " + value + "\n";
  return *this;
}

std::string StoreKey::hash() const { return sha256(kind_ + "\n" + model_ + "\n" + text_); }

std::filesystem::path StoreKey::path() const {
  return data_dir() / "data" / kind_ / fmt::format("{}_{}.exr", model_, hash().substr(0, 16));
}

std::optional<std::filesystem::path> find_stored(const StoreKey& key, const std::string& what,
                                                 const std::string& how_long) {
  const std::filesystem::path path = key.path();
  if (std::filesystem::exists(path)) return path;
  fmt::print(stderr, "brdfc: no {} in {}: making it, which takes {}\n", what, path.parent_path().string(), how_long);
  return std::nullopt;
}

void replace_stored(const StoreKey& key, const std::function<void(const std::filesystem::path&)>& write) {
  const std::filesystem::path path = key.path(), folder = path.parent_path();
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) input_error("{}: cannot be created: {}", folder.string(), error.message());
  write(path);
  const std::string prefix = key.model() + "_";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    // Names of models may begin alike: what follows is a hash of 16 digits and no more.
    if (name.starts_with(prefix) && name.size() == prefix.size() + 16 && entry.path() != path)
      std::filesystem::remove(entry.path());
  }
}

}  // namespace brdfc::inline tables
