// SPDX-License-Identifier: GPL-3.0-or-later
// What a pack holds of the add-on's folder: its Python, translations, and the manifest that Blender reads.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace brdfc::pack {

/// Contents by path within the folder, of .py files, translations/*.json, where `cut` is empty what library/ has beside
/// them, and blender_manifest.toml, which gets the version of this program in place of @version@, and where `cut` is
/// not empty an id and a name of its own: Blender puts an extension in the place of another one of its id, and what is
/// cut to a scene must not take that of the whole. Throws InputError for a file that can't be read, and for a manifest
/// without the lines `version = "@version@"`, `id = "brdfc_shaders"` and `name = "brdfc Shaders"`.
std::map<std::string, std::string> addon_files(const std::filesystem::path& folder, const std::string& cut = "");

/// The extension's id: brdfc_shaders, and where `cut`, the name of a file, is not empty what of it an id may have.
std::string extension_id(const std::string& cut);

/// A string as TOML writes it.
inline std::string quoted(const std::string& text) { return '"' + text + '"'; }
/// Gives a key another value in the text of the TOML file at `path`, which has that one on a line; values as TOML
/// writes them. Throws InputError if it has not.
void stamp(std::string& text, const std::filesystem::path& path, const char* key, const std::string& before,
           const std::string& after);

/// The whole file. Throws InputError.
std::string read_text(const std::filesystem::path&);

}  // namespace brdfc::pack
