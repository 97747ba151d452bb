// SPDX-License-Identifier: GPL-3.0-or-later
// Tables out of tables. What is computed is rounded to single precision, which is what shaders and files keep.
#pragma once

#include <map>
#include <string>

#include "tables/table.h"

namespace brdfc::inline tables {

/// The knots from `first` to `last`, both included, of an axis. Of an even axis they are even from 0 to 1 again.
Table part(const Table&, std::size_t axis, int first, int last);

/// The table at fixed coordinates of some axes, by name and in their units, without these axes: interpolated as
/// interpolate() does.
Table sliced(const Table&, const std::map<std::string, double>& fixed);

/// Multiplies all values; by a colour that is not grey, a table of one channel gets three.
void multiply(Table&, const Rgb<double>& color);

/// `offset` - the values.
void subtract_from(double offset, Table&);

/// Adds a table over the same axes; the errors add up. Throws std::logic_error if the axes differ.
void add(Table& sum, const Table& other);

}  // namespace brdfc::inline tables
