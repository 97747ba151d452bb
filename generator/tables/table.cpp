// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/table.h"

#include <cmath>
#include <stdexcept>
#include <utility>

#include "core/error.h"

namespace brdfc::inline tables {

TableAxis even_axis(std::string name, int size) {
  TableAxis axis{std::move(name), AxisScale::Linear, {}, true};
  for (int i = 0; i < size; ++i) axis.values.push_back(double(i) / (size - 1));
  return axis;
}

namespace {

/// The number of values over these axes.
std::size_t count_of(const std::string& name, const std::vector<TableAxis>& axes) {
  std::size_t count = 1;
  for (const TableAxis& a : axes) {
    if (a.size() < 2) throw std::logic_error("table " + name + ": an axis needs two knots");
    count *= a.values.size();
  }
  return count;
}

std::vector<double> checked(const std::string& name, std::size_t count, std::vector<double> values) {
  if (count != values.size()) throw std::logic_error("table " + name + ": axes do not match its values");
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i])) throw ValueError(fmt::format("table {}: value {} is {}", name, i, values[i]));
  return values;
}

}  // namespace

std::shared_ptr<const Table> make_table(std::string name, std::vector<TableAxis> axes, std::vector<double> values) {
  values = checked(name, count_of(name, axes), std::move(values));
  return std::make_shared<const Table>(Table{std::move(name), std::move(axes), 1, std::move(values), 0});
}

std::shared_ptr<const Table> make_table_later(std::string name, std::vector<TableAxis> axes,
                                              std::function<std::vector<double>()> compute) {
  TableValues values(
      [name, count = count_of(name, axes), compute = std::move(compute)] { return checked(name, count, compute()); });
  return std::make_shared<const Table>(Table{std::move(name), std::move(axes), 1, std::move(values), 0});
}

void require_lookup(const Table& t, std::size_t coordinates) {
  if (coordinates != t.axes.size()) throw std::logic_error("table " + t.name + ": wrong number of coordinates");
  const bool even = std::ranges::all_of(t.axes, [](const TableAxis& a) { return a.even; });
  if (t.axes.empty() || t.axes.size() > 4 || t.channels != 1 || !even)
    throw std::logic_error("table " + t.name + ": formulas look up one channel over 1 to 4 even axes");
}

Rgb<double> interpolate(const Table& t, const std::vector<double>& x) {
  // Computes the weights of the two knots on every axis, then sums over the corners of the cell.
  std::vector<std::size_t> cell;
  std::vector<double> weight;
  for (std::size_t a = 0; a < t.axes.size(); ++a) {
    const TableAxis& axis = t.axes[a];
    const auto above = std::upper_bound(axis.values.begin() + 1, axis.values.end() - 1, x.at(a));
    const std::size_t i = std::size_t(above - axis.values.begin()) - 1;
    const double lo = to_scale(axis.scale, axis.values[i]), hi = to_scale(axis.scale, axis.values[i + 1]);
    const double clamped = std::clamp(x[a], axis.values.front(), axis.values.back());
    cell.push_back(i);
    weight.push_back((to_scale(axis.scale, clamped) - lo) / (hi - lo));
  }
  const std::vector<double>& values = t.values;
  Rgb<double> sum(0);
  for (std::size_t corner = 0; corner < (std::size_t(1) << cell.size()); ++corner) {
    std::size_t index = 0;
    double w = 1;
    for (std::size_t a = 0; a < cell.size(); ++a) {
      const bool upper = corner >> a & 1;
      index = index * t.axes[a].values.size() + cell[a] + (upper ? 1 : 0);
      w *= upper ? weight[a] : 1 - weight[a];
    }
    const double* v = &values[index * std::size_t(t.channels)];
    sum += t.channels == 1 ? Rgb<double>(w * v[0]) : Rgb<double>(w * v[0], w * v[1], w * v[2]);
  }
  return sum;
}

template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 1>&);
template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 2>&);
template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 3>&);
template double lookup(const std::shared_ptr<const Table>&, const std::array<double, 4>&);

}  // namespace brdfc::inline tables
