// SPDX-License-Identifier: GPL-3.0-or-later
// The Python package of models: their formulas on NumPy arrays.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

/// Files of the package by their paths in it: a module a model, of its formulas in double precision, and the modules by
/// hand of `source`, a folder that holds __init__.py. Throws InputError if that is missing.
std::map<std::string, std::string> python_package(const std::vector<const Model*>&,
                                                  const std::filesystem::path& source);

/// Throws InputError if there is something in the folder that is not this package as written before.
void require_package(const std::filesystem::path& folder);

/// A module of f cos(theta_i) of the closures that forms are sums of, a function each, in the names that OSL has for
/// them: of components of wi, wo and the normal, and of what the closure takes. Directions above the surface.
std::string closures_module();

}  // namespace brdfc::pack
