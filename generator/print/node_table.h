// SPDX-License-Identifier: GPL-3.0-or-later
// Tables for Blender's nodes, which have none: a table with one axis becomes a polynomial.
#pragma once

#include <optional>
#include <vector>

#include "tables/table.h"
#include "trace/expr.h"

namespace brdfc::print {

/// Coefficients of the powers of 2 x - 1, constant term first, for x from 0 to 1. Returns nullopt for a table with
/// several axes, and if the relative error of a value exceeds 2e-4.
std::optional<std::vector<double>> polynomial_of(const Table&);

/// The value of the polynomial at x, which is clamped to [0, 1].
Expr polynomial_at(const std::vector<double>& coefficients, const Expr& x);

}  // namespace brdfc::print
