// SPDX-License-Identifier: GPL-3.0-or-later
// Albedo tables as EXR files.
#pragma once

#include <filesystem>

#include "measure/albedo_table.h"

namespace brdfc::measure {

/// Writes a float EXR with one row of pixels for each grid, padded with zeros to the length of the longest. The
/// attribute "brdfc:table" contains axes, scales, sizes, terms, errors and layout as JSON. The file is written under a
/// temporary name and renamed. Throws InputError that names the path if it can't be written.
void write_albedo_exr(const AlbedoTable&, const std::filesystem::path&);
/// Reads a table that write_albedo_exr() wrote; all numbers are restored exactly. Throws InputError that names the path
/// if it can't be read.
AlbedoTable read_albedo_exr(const std::filesystem::path&);

}  // namespace brdfc::measure
