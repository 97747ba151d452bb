// SPDX-License-Identifier: GPL-3.0-or-later
// Files that are either written completely or not at all.
#pragma once

#include <filesystem>
#include <functional>

namespace brdfc::inline core {

/// Calls write() with a temporary name beside `path` that has the same extension, then renames the file to `path`, so
/// that no half-written file is visible. Creates missing folders. Throws InputError if `path` can't be written.
void write_beside(const std::filesystem::path& path, const std::function<void(const std::filesystem::path&)>& write);

}  // namespace brdfc::inline core
