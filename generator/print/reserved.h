// SPDX-License-Identifier: GPL-3.0-or-later
// Names that models and parameters must not have, because the generated code uses them itself.
#pragma once

#include <optional>
#include <set>
#include <string>

namespace brdfc::print {

/// Names of the arguments and local variables of a model's formulas, as OSL functions (pack/standalone.h).
const std::set<std::string>& osl_function_words();
/// Names of arguments that Python functions have besides a model's parameters, which are keyword arguments: in the
/// Python package and in the extension's API. A test compares them with both.
const std::set<std::string>& python_arguments();

/// Who reserves the name of a parameter, for example "OSL or the generator" or "Python"; nullopt if it is free.
std::optional<std::string> reserved_for_parameters(const std::string& name);
/// The same for the name of a model.
std::optional<std::string> reserved_for_models(const std::string& name);

}  // namespace brdfc::print
