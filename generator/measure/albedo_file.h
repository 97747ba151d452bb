// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of albedos as EXR files.
#pragma once

#include <filesystem>

#include "measure/albedo_table.h"

namespace brdfc::measure {

/// Writes a float EXR: one row of pixels per grid, padded with zeros to the longest, and as JSON in the
/// attribute "brdfc:table" the axes, scales, sizes, terms, errors and layout. Written beside and renamed.
/// Throws InputError naming the path if it can't be written.
void write_albedo_exr(const AlbedoTable&, const std::filesystem::path&);
/// What write_albedo_exr() wrote, number for number. Throws InputError naming the path if it can't be read.
AlbedoTable read_albedo_exr(const std::filesystem::path&);

}  // namespace brdfc::measure
