// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers on a grid with named axes: what a table is, and how it is looked up.
#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/axis_scale.h"
#include "core/pack.h"
#include "core/scalar.h"
#include "core/vec.h"

namespace brdfc::inline tables {

/// What a table runs over.
struct TableAxis {
  std::string name;                     ///< a parameter's, "cos_theta_o" or another quantity's
  AxisScale scale = AxisScale::Linear;  ///< on which values between two knots are interpolated linearly
  std::vector<double> values;  ///< knots in units of the quantity, increasing, at least 2; beyond the ends those serve
  bool even = false;           ///< the knots are evenly spaced from 0 to 1 on a linear scale: see even_axis()

  int size() const { return int(values.size()); }
  bool operator==(const TableAxis&) const = default;
};
/// `size` knots, evenly spaced from 0 to 1.
TableAxis even_axis(std::string name, int size);

struct Table {
  std::string name;             ///< an identifier, that of its array in OSL; may be empty if formulas don't look it up
  std::vector<TableAxis> axes;  ///< none for a constant
  int channels = 1;             ///< 1, the same in red, green and blue; or 3
  std::vector<double> values;   ///< row-major, first axis slowest, channel innermost; may be negative
  double error = 0;             ///< largest known difference from what it stands for, in units of the values

  /// Values of a channel.
  std::size_t points() const { return values.size() / std::size_t(channels); }
};

/// Checks that axes and values fit together and that every value is finite. Throws std::logic_error for a malformed
/// table and ValueError naming table, index and value for one that is not finite.
std::shared_ptr<const Table> make_table(std::string name, std::vector<TableAxis> axes, std::vector<double> values);

/// Any table at one coordinate per axis, in units of the axis: linear on the axes' scales, constant beyond the ends.
Rgb<double> interpolate(const Table&, const std::vector<double>& coordinates);

/// A table of one channel and 1 to 4 even axes, over any scalar: what formulas look up. Multilinear; coordinates
/// outside [0, 1] take the nearest end.
template <Numeric T, std::size_t D> T lookup(const std::shared_ptr<const Table>& table, const std::array<T, D>& x) {
  std::array<T, D> fraction;
  std::array<std::size_t, D> index;
  for (std::size_t d = 0; d < D; ++d) {
    const T position = clamp01(x[d]) * T(table->axes[d].size() - 1);
    index[d] = std::min(std::size_t(position), std::size_t(table->axes[d].size() - 2));
    fraction[d] = position - T(index[d]);
  }
  T sum(0);
  for (std::size_t corner = 0; corner < (1u << D); ++corner) {
    T weight(1);
    std::size_t flat = 0;
    for (std::size_t d = 0; d < D; ++d) {
      const bool up = corner >> d & 1;
      weight = weight * (up ? fraction[d] : T(1) - fraction[d]);
      flat = flat * std::size_t(table->axes[d].size()) + index[d] + up;
    }
    sum = sum + weight * T(table->values[flat]);
  }
  return sum;
}

// Compiled in table.cpp alone, not in every source for each of its instruction sets.
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

/// Throws std::logic_error unless formulas can look this table up at so many coordinates.
void require_lookup(const Table&, std::size_t coordinates);

/// The same where only the table says how many coordinates there are.
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
