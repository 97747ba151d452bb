// SPDX-License-Identifier: GPL-3.0-or-later
// Stored albedo tables, with which packs are built in seconds.
#pragma once

#include "measure/albedo_table.h"
#include "model/model.h"
#include "tables/store.h"

namespace brdfc::measure {

/// True if packs contain an albedo table for the model. A model with delta terms only does not need one, because the
/// shader adds their weights. If it has few parameters it gets one nevertheless, for the panel, which can't run the
/// formula.
bool has_albedo_table(const Model&);
/// The key of a model's table: the model's formulas, its parameters and all settings.
StoreKey stored_albedo(const Model&);
/// The stored result of tabulate_albedo(). If there is none, the table is computed, and a line on stderr says so.
/// Throws InputError that names the file if it is damaged.
AlbedoTable albedo_table_of(const Model&);

}  // namespace brdfc::measure
