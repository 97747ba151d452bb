// SPDX-License-Identifier: GPL-3.0-or-later
// What a word that is not known was meant to be.
#pragma once

#include <string>
#include <vector>

namespace brdfc::inline core {

/// "did you mean ward? ", the known word that fewest letters have to be inserted in, left out of, changed in or swapped
/// with their neighbours; "" if those are more than a third of them.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& known);

}  // namespace brdfc::inline core
