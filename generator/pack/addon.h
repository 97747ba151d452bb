// SPDX-License-Identifier: GPL-3.0-or-later
// What a pack holds of the add-on's folder: its Python, and the manifest that Blender reads.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace brdfc::pack {

/// Contents by path within the folder, of .py files and of blender_manifest.toml, which gets the version of this
/// program in place of @version@. Throws InputError for a file that can't be read, and for a manifest without a line
/// `version = "@version@"`: its version might be another one than that of the shaders.
std::map<std::string, std::string> addon_files(const std::filesystem::path& folder);

/// The whole file. Throws InputError.
std::string read_text(const std::filesystem::path&);

}  // namespace brdfc::pack
