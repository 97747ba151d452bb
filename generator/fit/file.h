// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes fits as EXR files.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "fit/fit_tables.h"
#include "model/model.h"

namespace brdfc::fit {

/// Writes the tables as a float EXR with one row per table. The attribute brdfc:table describes them. `values` are
/// those that the fit was made for. `hash` identifies everything that the fit depends on; it may be empty. Throws
/// InputError naming the path if the file can't be written.
void write_fit(const FitTables&, const Model&, const ParamValues& values, const std::string& hash,
               const std::filesystem::path&);

/// Reads a fit along this axis (or none) with these terms, made with factors of 1. Every number is as passed to
/// write_fit(). Throws InputError naming the path if the file can't be read, has another hash, or is not a fit of this
/// shape.
FitTables read_fit(const std::optional<FitAxis>&, const Terms&, const std::string& hash, const std::filesystem::path&);

}  // namespace brdfc::fit
