// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/target.h"

#include <fmt/format.h>

#include <fstream>

#include "core/error.h"
#include "core/parse.h"
#include "core/process.h"
#include "pack/addon.h"

namespace brdfc::pack {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view kStaging = ".brdfc-build-";

bool is_staging(const fs::path& path) { return path.filename().string().starts_with(kStaging); }

/// Deletes the folders of processes that no longer exist.
void remove_abandoned(const fs::path& folder) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored)) {
    if (!is_staging(entry.path())) continue;
    const std::string name = entry.path().filename().string();
    const auto process = parse<long>(std::string_view(name).substr(kStaging.size()));
    if (process && process_is_over(*process)) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace

Staging::Staging(const fs::path& folder) : path_(folder / fmt::format("{}{}", kStaging, process_id())) {
  remove_abandoned(folder);
  std::error_code error;
  fs::create_directories(path_, error);
  if (error) input_error("{}: cannot be created: {}", path_.string(), error.message());
}

Staging::~Staging() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void replace_content(const fs::path& folder, const std::map<std::string, std::string>& files) {
  make_folder(folder);
  const Staging staging(folder);
  for (const auto& [name, text] : files) write_text(staging.path() / name, text);
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (!is_staging(entry.path()) && !error) fs::remove_all(entry.path(), error);
  for (const fs::directory_entry& entry : fs::directory_iterator(staging.path()))
    if (!error) fs::rename(entry.path(), folder / entry.path().filename(), error);
  if (error)
    input_error("{}: cannot be replaced: {}; does another process write to it?", folder.string(), error.message());
}

void require_replaceable(const fs::path& folder, const std::string& mark, const std::string& text) {
  std::error_code ignored;
  if (!fs::exists(fs::symlink_status(folder, ignored))) return;
  if (fs::is_directory(folder, ignored)) {
    if (fs::is_empty(folder, ignored)) return;
    if (fs::is_regular_file(folder / mark, ignored) && read_text(folder / mark).find(text) != std::string::npos) return;
  }
  input_error("{}: would be deleted: expected no such folder, an empty one, or one that brdfc wrote, with its {}",
              folder.string(), mark);
}

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) input_error("{}: expected a folder that can be written", folder.string());
}

void write_text(const fs::path& path, const std::string& text) {
  std::error_code ignored;
  fs::create_directories(path.parent_path(), ignored);
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) input_error("{}: cannot be written", path.string());
}

}  // namespace brdfc::pack
