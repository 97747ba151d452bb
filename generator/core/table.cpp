// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/table.h"

#include <cmath>
#include <stdexcept>

namespace brdfc {

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

}  // namespace brdfc
