// SPDX-License-Identifier: GPL-3.0-or-later
// Writes zip archives.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace brdfc::pack {

/// Times and order are fixed, so that the same members give the same bytes. Throws InputError naming the path.
void write_zip(const std::filesystem::path&, const std::map<std::string, std::string>& members);

}  // namespace brdfc::pack
