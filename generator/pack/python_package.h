// SPDX-License-Identifier: GPL-3.0-or-later
// The Python package of models: their formulas on NumPy arrays.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

/// The files of the package, by path within it: one module per model, with its formulas in double precision, and the
/// hand-written modules in `source`, a folder that contains __init__.py. Throws InputError if that file is missing.
std::map<std::string, std::string> python_package(const std::vector<const Model*>&,
                                                  const std::filesystem::path& source);

/// Throws InputError if the folder contains anything other than this package as written before.
void require_package(const std::filesystem::path& folder);

/// A module with a function for f cos(theta_i) of each closure that forms use, under its OSL name. The arguments are
/// the components of wi, wo and the normal, and the closure's parameters. Directions must be above the surface.
std::string closures_module();

}  // namespace brdfc::pack
