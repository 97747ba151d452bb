// SPDX-License-Identifier: GPL-3.0-or-later
// Where the files lie that the tool reads beside its input: stored fits and albedos, the extension's Python; and where
// it keeps what it has made.
#pragma once

#include <filesystem>
#include <optional>

namespace brdfc::inline core {

/// The first of these that holds the extension's Python: the folder that the environment variable BRDFC_DATA names,
/// and if it is set no other; share/brdfc beside the folder of the program, as `cmake --install` lays it out; the
/// nearest folder above the program, as are the sources that it is built in. Stored fits and albedos are in its folder
/// data, the Python in blender_addon. Throws InputError that names what was looked for and where.
std::filesystem::path data_dir();

/// The user's folder for what takes long to make and can be made again: the one that the environment variable
/// BRDFC_CACHE names, none if that is empty; without it brdfc in XDG_CACHE_HOME or ~/.cache. It may not exist yet.
std::optional<std::filesystem::path> cache_dir();

}  // namespace brdfc::inline core
