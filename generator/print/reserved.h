// SPDX-License-Identifier: GPL-3.0-or-later
// Names that models and their parameters may not have, since what is made of a model uses them itself.
#pragma once

#include <optional>
#include <set>
#include <string>

namespace brdfc::print {

/// Names of the arguments and local variables of a model's formulas as functions of OSL (pack/standalone.h).
const std::set<std::string>& osl_function_words();
/// Names of the arguments that functions in Python have beside a model's parameters, which they take by name: those of
/// the Python package and of the extension's api. A test compares them with both.
const std::set<std::string>& python_arguments();

/// Who has that name already, where a parameter may not have it: "OSL or the generator", "Python" or the like.
std::optional<std::string> reserved_for_parameters(const std::string& name);
/// The same for the name of a model.
std::optional<std::string> reserved_for_models(const std::string& name);

}  // namespace brdfc::print
