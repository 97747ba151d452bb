// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_table.h"

#include <algorithm>
#include <cmath>

namespace brdfc::measure {

std::size_t AlbedoTable::size() const {
  std::size_t n = 0;
  for (const Table& g : grids) n += g.values.size();
  return n;
}

const std::vector<AlbedoTerm>& AlbedoTable::terms_for(const Model& m, const ParamValues& given) const {
  const ParamValues values = complete(m.info(), given);
  std::size_t index = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const ParamInfo& p = *m.info().param(choices[i]);
    const auto at = std::find(p.choices.begin(), p.choices.end(), std::get<std::string>(values.at(p.name)));
    index = index * std::size_t(choice_sizes[i]) + std::size_t(at - p.choices.begin());
  }
  return terms.at(index);
}

Rgb<double> lookup(const AlbedoTable& table, const Model& m, const ParamValues& given, double cos_theta_o) {
  const ParamValues values = complete(m.info(), given);
  Rgb<double> sum(0);
  for (const AlbedoTerm& t : table.terms_for(m, values)) {
    const Table& g = table.grids.at(std::size_t(t.grid));
    std::vector<double> x;
    for (const TableAxis& a : g.axes)
      x.push_back(a.name == "cos_theta_o" ? cos_theta_o : std::get<double>(values.at(a.name)));
    Rgb<double> product = interpolate(g, x);
    for (const std::string& c : t.colors) {
      const auto& v = std::get<std::array<double, 3>>(values.at(c));
      product = product * Rgb<double>(v[0], v[1], v[2]);
    }
    sum += product;
  }
  return sum;
}

}  // namespace brdfc::measure
