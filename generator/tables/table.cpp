// SPDX-License-Identifier: GPL-3.0-or-later
#include "tables/table.h"

#include <cmath>
#include <stdexcept>

#include "core/error.h"

namespace brdfc::inline tables {

std::shared_ptr<const Table> make_table(std::string name, std::vector<int> sizes, std::vector<double> values) {
  std::size_t count = 1;
  for (int s : sizes) {
    if (s < 2) throw std::logic_error("table " + name + ": an axis needs two knots");
    count *= std::size_t(s);
  }
  if (sizes.empty() || sizes.size() > 4 || count != values.size())
    throw std::logic_error("table " + name + ": sizes do not match its values");
  for (std::size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i])) throw ValueError(fmt::format("table {}: value {} is {}", name, i, values[i]));
  return std::make_shared<const Table>(Table{std::move(name), std::move(sizes), std::move(values)});
}

std::shared_ptr<const Table> part(const Table& table, std::size_t axis, int first, int last) {
  std::vector<int> sizes = table.sizes;
  std::size_t stride = 1;
  for (std::size_t a = axis + 1; a < sizes.size(); ++a) stride *= std::size_t(sizes[a]);
  std::vector<double> values;
  for (std::size_t i = 0; i < table.values.size(); ++i)
    if (const int knot = int(i / stride % std::size_t(sizes[axis])); knot >= first && knot <= last)
      values.push_back(table.values[i]);
  sizes[axis] = last - first + 1;
  return make_table(table.name, std::move(sizes), std::move(values));
}

}  // namespace brdfc::inline tables
