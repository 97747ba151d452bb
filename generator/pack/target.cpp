// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/target.h"

#include <fstream>

#include "core/error.h"
#include "pack/addon.h"

namespace brdfc::pack {

namespace fs = std::filesystem;

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
