// SPDX-License-Identifier: GPL-3.0-or-later
// Tables in OSL: arrays of numbers, and look-ups in them.
#pragma once

#include <string>
#include <vector>

#include "print/statement.h"
#include "tables/table.h"

namespace brdfc::print {

/// Maximum number of values in one OSL array; larger ones compile slowly.
inline constexpr std::size_t kMaxArray = 32768;

/// The declaration of an array, without superfluous spaces: tables make up most of the text of a long shader.
std::string compact_array(const std::string& name, const std::vector<double>& values, int indent);

/// The arrays of a table that positions() and look_up() read: the knots of each axis, on the scale of the axis, and the
/// values of each channel. Their names end in _`suffix`.
Statements table_arrays(const Table&, const std::string& suffix);

/// Declares the positions of the coordinates among the knots of each axis, for look_up(). Coordinates are in units of
/// the axes. Empty for a constant table.
Statements positions(const Table&, const std::vector<Value>& coordinates, const std::string& suffix);

/// The interpolated value: a float, or a color for three channels. Throws std::logic_error for more than four axes.
Value look_up(const Table&, const std::string& suffix);

/// The library function that looks up one channel. Its arguments are the array, the size of each axis, and the
/// positions among the knots, from 0 to size - 1.
std::string table_function(const Table&);
}  // namespace brdfc::print
