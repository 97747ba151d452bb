// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of albedos that are kept, so that packs are built in seconds.
#pragma once

#include <filesystem>

#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::measure {

/// Does a pack have the table? Delta terms alone need none: the shader adds up their weights. With few parameters they
/// still get one, for the panel, which can't run the formula.
bool has_albedo_table(const Model&);
/// Where the table of a model is kept: data/albedos/MODEL_HASH.exr, by hash of what the model computes, its
/// parameters and the settings of tables.
std::filesystem::path stored_albedo(const Model&);
/// What is kept of tabulate_albedo(); without it the table is made, and a line on stderr says so. Throws InputError
/// naming the file if that is damaged.
AlbedoTable albedo_table_of(const Model&);

}  // namespace brdfc::measure
