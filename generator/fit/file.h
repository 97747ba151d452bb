// SPDX-License-Identifier: GPL-3.0-or-later
// Fits as EXR files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "fit/fit_tables.h"
#include "model/model.h"

namespace brdfc::fit {

/// Writes the tables as a float EXR with a row a table; what they are stands in its attribute brdfc:table. `values` are
/// those that the fit was made for. `hash` says what the fit depends on, and may be empty. Throws InputError naming the
/// path if it can't be written.
void write_fit(const FitTables&, const Model&, const ParamValues& values, const std::string& hash,
               const std::filesystem::path&);

/// A fit along this axis, or none, and over these terms, made with factors of 1, number for number as write_fit() got
/// it. Throws InputError naming the path if it can't be read, has another hash, or is not a fit of this shape.
FitTables read_fit(const std::optional<FitAxis>&, const Terms&, const std::string& hash, const std::filesystem::path&);

}  // namespace brdfc::fit
