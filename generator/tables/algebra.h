// SPDX-License-Identifier: GPL-3.0-or-later
// Operations that make tables from tables. Results are rounded to single precision, which is what shaders and files
// store.
#pragma once

#include <map>
#include <string>

#include "tables/table.h"

namespace brdfc::inline tables {

/// The table with the knots from `first` to `last`, both included, of one axis. The knots of an even axis are
/// renumbered evenly from 0 to 1.
Table part(const Table&, std::size_t axis, int first, int last);

/// The table at fixed coordinates of some axes, without these axes. Coordinates are given by axis name, in units of the
/// axis; values are interpolated as interpolate() does.
Table sliced(const Table&, const std::map<std::string, double>& fixed);

/// Multiplies all values by a colour. If the colour is not grey, a table of one channel gets three.
void multiply(Table&, const Rgb<double>& color);

/// Replaces every value v by `offset` - v.
void subtract_from(double offset, Table&);

/// Adds a table over the same axes to `sum`, and adds their errors. Throws std::logic_error if the axes differ.
void add(Table& sum, const Table& other);

}  // namespace brdfc::inline tables
