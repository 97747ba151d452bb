// SPDX-License-Identifier: GPL-3.0-or-later
// The names that shaders use themselves: those of OSL, and those that the generator writes around a model's statements.
// A test compares this list with the shaders of all forms, and reports missing names.
#pragma once

#include <set>
#include <string>

namespace brdfc::print {

/// Names that a parameter or a statement must not use: keywords of OSL, functions and globals that shaders use, and
/// variables that the generator declares.
const std::set<std::string>& osl_words();
/// Prefixes of the names that a shader numbers, for example weight_0, normal_0_x or knots_0_1.
const std::set<std::string>& numbered_osl_words();

/// True if shaders use the name themselves, so that neither a parameter nor a model's statements may use it.
bool is_osl_word(const std::string& name);

/// A base for numbered names: `name`, or another name if every `name` with a number would be an OSL word.
std::string unnumbered(const std::string& name);

}  // namespace brdfc::print
