// SPDX-License-Identifier: GPL-3.0-or-later
// The one list of names that the text of a shader uses itself: of OSL, and of what the generator writes around a
// model's statements. A test compares it with the text of every form, and names what is missing here.
#pragma once

#include <set>
#include <string>

namespace brdfc::print {

/// Words of OSL that a parameter or a statement may not have for a name, functions and globals that shaders use, and
/// the names of their own statements.
const std::set<std::string>& osl_words();
/// Beginnings of names that a shader numbers, as in weight_0, normal_0_x or knots_0_1.
const std::set<std::string>& numbered_osl_words();

/// Whether a shader has that name for something else, so that neither a parameter nor a model's statement may have it.
bool is_osl_word(const std::string& name);

/// The name, or another if no number after it could make it one that is free.
std::string unnumbered(const std::string& name);

}  // namespace brdfc::print
