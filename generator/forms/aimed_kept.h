// SPDX-License-Identifier: GPL-3.0-or-later
// What the loop over lamps in an aimed shader keeps of a lamp and its lobe for later iterations.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "print/statement.h"

namespace brdfc::forms {

/// The array with the numbers of each lamp or of each lobe. `of`: "lamp" or "lobe".
std::string kept_array(std::string_view of);
/// Keeps the variables of the current lamp or of its lobe.
print::Statement keep(std::string_view of);
/// Declares variables <of>_<name> with the numbers of a lobe and its lamp, which are kept at this index.
print::Statements load(const std::string& of, const char* index, const std::vector<std::string_view>& names);

}  // namespace brdfc::forms
