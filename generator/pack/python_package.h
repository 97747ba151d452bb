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

}  // namespace brdfc::pack
