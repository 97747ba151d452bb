// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/algebra.h"

#include <stdexcept>
#include <utility>

namespace brdfc::inline tables {
namespace {

void give_three_channels(Table& t) {
  std::vector<double> values;
  for (const double v : t.values) values.insert(values.end(), 3, v);
  t.channels = 3;
  t.values = std::move(values);
}

}  // namespace

Table part(const Table& t, std::size_t axis, int first, int last) {
  Table out = t;
  std::vector<double> values;
  std::size_t stride = std::size_t(t.channels);
  for (std::size_t a = axis + 1; a < t.axes.size(); ++a) stride *= t.axes[a].values.size();
  for (std::size_t i = 0; i < t.values.size(); ++i)
    if (const int knot = int(i / stride % t.axes[axis].values.size()); knot >= first && knot <= last)
      values.push_back(t.values[i]);
  out.values = std::move(values);
  if (t.axes[axis].even)
    out.axes[axis] = even_axis(t.axes[axis].name, last - first + 1);
  else
    out.axes[axis].values.assign(t.axes[axis].values.begin() + first, t.axes[axis].values.begin() + last + 1);
  return out;
}

Table sliced(const Table& t, const std::map<std::string, double>& fixed) {
  Table out = t;
  std::erase_if(out.axes, [&](const TableAxis& axis) { return fixed.count(axis.name) > 0; });
  std::vector<double> values;
  std::vector<std::size_t> index(out.axes.size(), 0);
  for (bool more = true; more;) {
    std::vector<double> x;
    std::size_t kept = 0;
    for (const TableAxis& axis : t.axes) {
      const auto it = fixed.find(axis.name);
      x.push_back(it == fixed.end() ? axis.values[index[kept]] : it->second);
      if (it == fixed.end()) ++kept;
    }
    const Rgb<double> v = interpolate(t, x);
    const double channels[] = {v.r, v.g, v.b};
    for (int c = 0; c < t.channels; ++c) values.push_back(double(float(channels[c])));
    more = false;
    for (std::size_t a = out.axes.size(); a-- > 0 && !more;) {
      more = ++index[a] < out.axes[a].values.size();
      if (!more) index[a] = 0;
    }
  }
  out.values = std::move(values);
  return out;
}

void multiply(Table& t, const Rgb<double>& color) {
  const double factors[] = {color.r, color.g, color.b};
  const bool grey = color.r == color.g && color.g == color.b;
  if (t.channels == 1 && !grey) give_three_channels(t);
  std::vector<double> values = t.values;
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = double(float(values[i] * factors[i % std::size_t(t.channels)]));
  t.values = std::move(values);
}

void subtract_from(double offset, Table& t) {
  std::vector<double> values = t.values;
  for (double& v : values) v = double(float(offset - v));
  t.values = std::move(values);
}

void add(Table& sum, const Table& other) {
  if (sum.axes != other.axes) throw std::logic_error("tables over other axes can't be added");
  Table more = other;
  if (sum.channels != more.channels) give_three_channels(sum.channels == 1 ? sum : more);
  std::vector<double> values = sum.values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(float(values[i] + more.values[i]));
  sum.values = std::move(values);
  sum.error += more.error;
}

}  // namespace brdfc::inline tables
