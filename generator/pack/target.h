// SPDX-License-Identifier: GPL-3.0-or-later
// Output folders of commands, and what commands may delete in them.
#pragma once

#include <filesystem>
#include <string>

namespace brdfc::pack {

/// Throws InputError unless the folder is absent, empty, or written by this tool, because its contents are about to be
/// deleted. A folder counts as written by this tool if its file `mark` contains `text`.
void require_replaceable(const std::filesystem::path& folder, const std::string& mark, const std::string& text);

/// Makes the folder if it does not exist. Throws InputError if that fails.
void make_folder(const std::filesystem::path&);

/// Writes a file, after making its folder if that does not exist. Throws InputError if it can't be written.
void write_text(const std::filesystem::path&, const std::string& text);

}  // namespace brdfc::pack
