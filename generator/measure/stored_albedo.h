// SPDX-License-Identifier: GPL-3.0-or-later
// Tables of albedos that are kept, so that packs are built in seconds.
#pragma once

#include "measure/albedo_table.h"
#include "model/model.h"
#include "tables/store.h"

namespace brdfc::measure {

/// Does a pack have the table? Delta terms alone need none: the shader adds up their weights. With few parameters they
/// still get one, for the panel, which can't run the formula.
bool has_albedo_table(const Model&);
/// The key of a model's table: what the model computes, its parameters and all settings.
StoreKey stored_albedo(const Model&);
/// What is kept of tabulate_albedo(); without it the table is made, and a line on stderr says so. Throws InputError
/// naming the file if that is damaged.
AlbedoTable albedo_table_of(const Model&);

}  // namespace brdfc::measure
