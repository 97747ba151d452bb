// SPDX-License-Identifier: GPL-3.0-or-later
// Locations of the tool's data (stored fits and albedos, the extension's Python) and of the user's cache.
#pragma once

#include <filesystem>
#include <optional>

namespace brdfc::inline core {

/// The folder with the tool's data: stored fits and albedos in its subfolder data, the extension's Python in
/// blender_addon. If the environment variable BRDFC_DATA is set, it names the folder. Otherwise it is the first of
/// these that contains the extension's Python: share/brdfc beside the program's folder, as `cmake --install` lays it
/// out; then the nearest folder above the program, as in a build inside the source tree. Throws InputError that says
/// where it was looked for and names `needed`, a file or folder in it for which the caller asks.
std::filesystem::path data_dir(const std::filesystem::path& needed = {});
/// The path of that file or folder, which may not exist in a folder with other data.
std::filesystem::path data_path(const std::filesystem::path& needed);

/// The user's cache, for results that take long to compute and can be computed again. The environment variable
/// BRDFC_CACHE names it; if that is empty there is no cache. Without the variable it is brdfc in XDG_CACHE_HOME or in
/// ~/.cache. The folder may not exist yet.
std::optional<std::filesystem::path> cache_dir();

}  // namespace brdfc::inline core
