// SPDX-License-Identifier: GPL-3.0-or-later
// Folders that commands write to, and what they may delete there.
#pragma once

#include <filesystem>
#include <string>

namespace brdfc::pack {

/// Throws InputError unless the folder is absent, empty or one that this tool wrote, which `mark`, a file in it, says
/// by having `text` in it: what is there is about to be deleted.
void require_replaceable(const std::filesystem::path& folder, const std::string& mark, const std::string& text);

/// Makes it unless it is there. Throws InputError.
void make_folder(const std::filesystem::path&);

}  // namespace brdfc::pack
