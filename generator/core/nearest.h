// SPDX-License-Identifier: GPL-3.0-or-later
// Suggestions for misspelt names.
#pragma once

#include <string>
#include <vector>

namespace brdfc::inline core {

/// "did you mean ward? ", with the known words at the smallest edit distance from `word`, and those that contain it.
/// Edits insert, remove or change a letter, or swap two neighbouring letters. Returns "" if there is no such word: if
/// more than a third of the letters would have to be edited.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& known);

}  // namespace brdfc::inline core
