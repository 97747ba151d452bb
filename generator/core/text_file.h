// SPDX-License-Identifier: GPL-3.0-or-later
// Text files as programs on any system write them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace brdfc::inline core {

/// The text in UTF-8 with "\n" as line ends, without the mark that may precede it. The bytes may be UTF-8, or UTF-16
/// with a mark; lines may end with "\n", "\r\n" or "\r". Throws InputError naming `file` for bytes that
/// are no text.
std::string plain_text(const std::string& bytes, const std::string& file);

/// The lines of a file's plain_text(). Throws InputError also if it can't be read.
std::vector<std::string> read_lines(const std::filesystem::path& file);

}  // namespace brdfc::inline core
