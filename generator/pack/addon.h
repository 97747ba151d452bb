// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a pack that come from the add-on's folder: Python, translations, and the manifest that Blender reads.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace brdfc::pack {

/// The contents, by path within the folder, of .py files, translations/*.json, and blender_manifest.toml; if `cut` is
/// empty, also of the other files in library/. In the manifest @version@ is replaced by the version of this program. If
/// `cut` is not empty, the manifest gets its own id and name: Blender replaces an installed extension by another one
/// with the same id, and a pack that is cut to a scene must not replace the whole one. Throws InputError for a file
/// that can't be read, and for a manifest without the lines `version = "@version@"`, `id = "brdfc_shaders"` and `name =
/// "brdfc Shaders"`.
std::map<std::string, std::string> addon_files(const std::filesystem::path& folder, const std::string& cut = "");

/// The extension's id: brdfc_shaders. If `cut`, the name of a file, is not empty, the characters of it that an id may
/// have are appended.
std::string extension_id(const std::string& cut);

/// A string in TOML syntax.
inline std::string quoted(const std::string& text) { return '"' + text + '"'; }
/// Replaces the value of a key in the text of the TOML file at `path`. Values are in TOML syntax. Throws InputError if
/// no line has the key with the value `before`.
void stamp(std::string& text, const std::filesystem::path& path, const char* key, const std::string& before,
           const std::string& after);

/// The text of the whole file. Throws InputError if it can't be read.
std::string read_text(const std::filesystem::path&);

}  // namespace brdfc::pack
