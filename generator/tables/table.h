// SPDX-License-Identifier: GPL-3.0-or-later
// Tables that formulas may look up, over any scalar type.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/scalar.h"

namespace brdfc::inline tables {

/// Values on a regular grid over [0, 1]^d, d = 1 to 4, row-major with the first axis slowest.
struct Table {
  std::string name;        ///< an identifier; names the array in OSL
  std::vector<int> sizes;  ///< knots of each axis, at least 2
  std::vector<double> values;
};

/// Checks sizes and that every value is finite. Throws std::logic_error for a malformed table and ValueError naming
/// table, index and value for one that is not finite.
std::shared_ptr<const Table> make_table(std::string name, std::vector<int> sizes, std::vector<double> values);

/// The knots from `first` to `last` of an axis.
std::shared_ptr<const Table> part(const Table&, std::size_t axis, int first, int last);

/// Multilinear interpolation; coordinates outside [0, 1] take the nearest end.
template <Numeric T, std::size_t D> T lookup(const std::shared_ptr<const Table>& table, const std::array<T, D>& x) {
  std::array<T, D> fraction;
  std::array<std::size_t, D> index;
  for (std::size_t d = 0; d < D; ++d) {
    const T position = clamp01(x[d]) * T(table->sizes[d] - 1);
    index[d] = std::min(std::size_t(position), std::size_t(table->sizes[d] - 2));
    fraction[d] = position - T(index[d]);
  }
  T sum(0);
  for (std::size_t corner = 0; corner < (1u << D); ++corner) {
    T weight(1);
    std::size_t flat = 0;
    for (std::size_t d = 0; d < D; ++d) {
      const bool up = corner >> d & 1;
      weight = weight * (up ? fraction[d] : T(1) - fraction[d]);
      flat = flat * std::size_t(table->sizes[d]) + index[d] + up;
    }
    sum = sum + weight * T(table->values[flat]);
  }
  return sum;
}

/// The same where only the table says how many coordinates there are.
template <Numeric T> T lookup(const std::shared_ptr<const Table>& table, const std::vector<T>& x) {
  const auto of = [&]<std::size_t D>(std::array<T, D> at) {
    std::copy_n(x.begin(), D, at.begin());
    return lookup(table, at);
  };
  if (x.size() != table->sizes.size()) throw std::logic_error("table " + table->name + ": wrong number of coordinates");
  switch (x.size()) {
    case 1:
      return of(std::array<T, 1>{});
    case 2:
      return of(std::array<T, 2>{});
    case 3:
      return of(std::array<T, 3>{});
    default:
      return of(std::array<T, 4>{});
  }
}

}  // namespace brdfc::inline tables
