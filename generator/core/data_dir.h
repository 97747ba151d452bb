// SPDX-License-Identifier: GPL-3.0-or-later
// Where the files lie that the tool reads beside its input: stored fits and albedos, the extension's Python.
#pragma once

#include <filesystem>
#include <string>

namespace brdfc::inline core {

/// The first of these that holds the extension's Python: the folder that the environment variable BRDFC_DATA names,
/// and if it is set no other; share/brdfc beside the folder of the program, as `cmake --install` lays it out; the
/// sources that the program was built from. Throws InputError that names what was looked for and where.
std::filesystem::path data_dir();

/// A folder of it, "fits", "albedos" or "blender_addon", whether data_dir() is installed or a tree of sources.
std::filesystem::path data_dir(const std::string& name);

/// Tells on stderr that something is not in its store and is made, which takes that long.
void note_missing(const std::string& what, const std::filesystem::path& store, const std::string& how_long);

}  // namespace brdfc::inline core
