// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/write_beside.h"

#include <fmt/format.h>

#include "core/error.h"
#include "core/process.h"

namespace brdfc::inline core {

namespace fs = std::filesystem;

void write_beside(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  std::error_code error;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) input_error("{}: can't create this folder", folder.string());
  if (fs::is_directory(path)) input_error("{}: is a folder, expected a file name", path.string());
  const fs::path temporary =
      folder / fmt::format(".{}.{}{}", path.stem().string(), process_id(), path.extension().string());
  try {
    write(temporary);
    fs::rename(temporary, path, error);
    if (error) input_error("{}: can't write ({})", path.string(), error.message());
  } catch (...) {
    fs::remove(temporary, error);
    throw;
  }
}

}  // namespace brdfc::inline core
