// SPDX-License-Identifier: GPL-3.0-or-later
// Common code of the fuzz targets. A reader of untrusted files may do two things with any bytes: read them, or throw
// InputError with a message of one line. Any other exception ends the target, as a memory error does.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "core/error.h"

namespace brdfc::fuzz {

/// A folder for this process, in memory if the system has such a place; deleted at the end.
inline const std::filesystem::path& folder() {
  static const struct Folder {
    std::filesystem::path path;
    Folder() {
      namespace fs = std::filesystem;
      path = (fs::is_directory("/dev/shm") ? fs::path("/dev/shm") : fs::temp_directory_path()) /
             ("brdfc-fuzz-" + std::to_string(::getpid()));
      fs::create_directories(path);
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  } made;
  return made.path;
}

inline std::filesystem::path write(const std::string& name, const std::uint8_t* data, std::size_t size) {
  const std::filesystem::path path = folder() / name;
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(data), std::streamsize(size));
  return path;
}

/// Runs a reader, and checks and catches its exceptions.
template <class Read> void expect_value_or_input_error(const Read& read) {
  try {
    read();
  } catch (const InputError& e) {
    const std::string message = e.what();
    if (message.empty() || message.find('\n') != std::string::npos) {
      std::fprintf(stderr, "not a message of one line: '%s'\n", message.c_str());
      std::abort();
    }
  }
}

}  // namespace brdfc::fuzz
