// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit along a number is kept by.
#pragma once

#include <filesystem>
#include <string>

#include "model/model.h"

namespace brdfc::fit {

/// The hash of all that a fit along an axis depends on but the code: what the model computes, the values, the slider,
/// the settings. `values` are those of along_axis().
std::string hash_of(const Model&, const ParamValues& values);

/// Where a fit of this hash is kept: data/fits/MODEL_HASH.exr beside the tool's other data.
std::filesystem::path path_of(const Model&, const std::string& hash);
/// The same of the fit along the number that `values` lack.
std::filesystem::path stored_fit(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
