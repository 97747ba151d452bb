// SPDX-License-Identifier: GPL-3.0-or-later
// Tables for Blender's nodes, which have none: one of a single axis becomes a polynomial.
#pragma once

#include <optional>
#include <vector>

#include "tables/table.h"
#include "trace/expr.h"

namespace brdfc::print {

/// Coefficients of the powers of 2 x - 1, the constant first, for x from 0 to 1; nullopt for a table of several axes,
/// or where values are more than 2e-4 of themselves off.
std::optional<std::vector<double>> polynomial_of(const Table&);

/// Its value at x, which is clamped to [0, 1].
Expr polynomial_at(const std::vector<double>& coefficients, const Expr& x);

}  // namespace brdfc::print
