// SPDX-License-Identifier: GPL-3.0-or-later
// Tables as OSL: arrays of numbers, and look-ups in them.
#pragma once

#include <string>
#include <vector>

#include "print/statement.h"
#include "tables/table.h"

namespace brdfc::print {

/// Numbers in one OSL array; more compile slowly.
inline constexpr std::size_t kMaxArray = 32768;

/// The declaration of an array, short: tables are most of a long shader's text.
std::string compact_array(const std::string& name, const std::vector<double>& values, int indent);

/// Arrays of a table that positions() and look_up() read: of the knots of each axis on its scale, and of each channel.
/// Their names end in _`suffix`.
Statements table_arrays(const Table&, const std::string& suffix);

/// Declares where coordinates, values in units of the axes, lie among the knots of each axis, for look_up(). Nothing
/// for a constant.
Statements positions(const Table&, const std::vector<Value>& coordinates, const std::string& suffix);

/// The interpolated value: a float, or a color of three channels. Throws std::logic_error for more than four axes.
Value look_up(const Table&, const std::string& suffix);

/// The function of the library that looks a channel up: of its array, the size of each axis, and at positions among
/// the knots, from 0 to size - 1.
std::string table_function(const Table&);
}  // namespace brdfc::print
