// SPDX-License-Identifier: GPL-3.0-or-later
// Tables: numbers on a grid with named axes, and how to look them up.
#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/axis_scale.h"
#include "core/pack.h"
#include "core/scalar.h"
#include "core/vec.h"
#include "tables/table_values.h"

namespace brdfc::inline tables {

/// An axis of a table.
struct TableAxis {
  std::string name;                     ///< name of a parameter, "cos_theta_o" or another quantity
  AxisScale scale = AxisScale::Linear;  ///< scale of the linear interpolation between two knots
  std::vector<double> values;           ///< at least 2 increasing knots, in units of the quantity; clamped at the ends
  bool even = false;                    ///< knots are evenly spaced from 0 to 1 on a linear scale: see even_axis()

  int size() const { return int(values.size()); }
  bool operator==(const TableAxis&) const = default;
};
/// An axis with `size` knots, evenly spaced from 0 to 1.
TableAxis even_axis(std::string name, int size);

struct Table {
  std::string name;             ///< identifier of the array in OSL; may be empty if no formula looks the table up
  std::vector<TableAxis> axes;  ///< empty for a constant
  int channels = 1;             ///< 1, if red, green and blue are the same; otherwise 3
  TableValues values;           ///< row-major, first axis slowest, channel innermost; may be negative
  double error = 0;             ///< largest known difference from the tabulated quantity, in units of the values

  /// Number of values in one channel.
  std::size_t points() const { return values.size() / std::size_t(channels); }
};

/// Makes a table, after checking that axes and values match and that every value is finite. Throws std::logic_error for
/// a malformed table, and ValueError that names table, index and value for a value that is not finite.
std::shared_ptr<const Table> make_table(std::string name, std::vector<TableAxis> axes, std::vector<double> values);
/// The same with values that are computed, and checked, when they are first read.
std::shared_ptr<const Table> make_table_later(std::string name, std::vector<TableAxis> axes,
                                              std::function<std::vector<double>()> compute);

/// Looks up any table at one coordinate per axis, in units of the axis. Interpolation is linear on the scales of the
/// axes; coordinates beyond the ends are clamped.
Rgb<double> interpolate(const Table&, const std::vector<double>& coordinates);

/// The look-up that formulas use, over any scalar: multilinear, in a table of one channel and 1 to 4 even axes.
/// Coordinates are clamped to [0, 1].
template <Numeric T, std::size_t D> T lookup(const std::shared_ptr<const Table>& table, const std::array<T, D>& x) {
  std::array<T, D> fraction;
  std::array<std::size_t, D> index;
  for (std::size_t d = 0; d < D; ++d) {
    const T position = clamp01(x[d]) * T(table->axes[d].size() - 1);
    index[d] = std::min(std::size_t(position), std::size_t(table->axes[d].size() - 2));
    fraction[d] = position - T(index[d]);
  }
  const std::vector<double>& values = table->values;
  T sum(0);
  for (std::size_t corner = 0; corner < (1u << D); ++corner) {
    T weight(1);
    std::size_t flat = 0;
    for (std::size_t d = 0; d < D; ++d) {
      const bool up = corner >> d & 1;
      weight = weight * (up ? fraction[d] : T(1) - fraction[d]);
      flat = flat * std::size_t(table->axes[d].size()) + index[d] + up;
    }
    sum = sum + weight * T(values[flat]);
  }
  return sum;
}

// Compiled in table.cpp only, not in every source for each of its instruction sets.
extern template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 1>&);
extern template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 2>&);
extern template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 3>&);
extern template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 4>&);

template <std::size_t D> Pack lookup(const std::shared_ptr<const Table>& table, const std::array<Pack, D>& x) {
  Pack out;
  for (std::size_t k = 0; k < kLanes; ++k) {
    std::array<double, D> at;
    for (std::size_t d = 0; d < D; ++d) at[d] = x[d][k];
    out[k] = lookup(table, at);
  }
  return out;
}

/// Throws std::logic_error unless formulas can look this table up at this number of coordinates.
void require_lookup(const Table&, std::size_t coordinates);

/// The same look-up for a number of coordinates that is known only at run time.
template <Arithmetic T> T lookup(const std::shared_ptr<const Table>& table, const std::vector<T>& x) {
  const auto of = [&]<std::size_t D>(std::array<T, D> at) {
    std::copy_n(x.begin(), D, at.begin());
    return lookup(table, at);
  };
  require_lookup(*table, x.size());
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
