// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_table.h"

#include <algorithm>
#include <cmath>

namespace brdfc::measure {

std::size_t AlbedoTable::size() const {
  std::size_t n = 0;
  for (const AlbedoGrid& g : grids) n += g.values.size();
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

Rgb<double> lookup(const AlbedoGrid& g, const std::vector<double>& x) {
  // Weights of the two knots on every axis, then the sum over the corners of the cell.
  std::vector<std::size_t> cell;
  std::vector<double> weight;
  for (std::size_t a = 0; a < g.axes.size(); ++a) {
    const TableAxis& axis = g.axes[a];
    const auto above = std::upper_bound(axis.values.begin() + 1, axis.values.end() - 1, x.at(a));
    const std::size_t i = std::size_t(above - axis.values.begin()) - 1;
    const double lo = to_scale(axis.scale, axis.values[i]), hi = to_scale(axis.scale, axis.values[i + 1]);
    const double clamped = std::clamp(x[a], axis.values.front(), axis.values.back());
    cell.push_back(i);
    weight.push_back((to_scale(axis.scale, clamped) - lo) / (hi - lo));
  }
  Rgb<double> sum(0);
  for (std::size_t corner = 0; corner < (std::size_t(1) << cell.size()); ++corner) {
    std::size_t index = 0;
    double w = 1;
    for (std::size_t a = 0; a < cell.size(); ++a) {
      const bool upper = corner >> a & 1;
      index = index * g.axes[a].values.size() + cell[a] + (upper ? 1 : 0);
      w *= upper ? weight[a] : 1 - weight[a];
    }
    const float* v = &g.values[index * std::size_t(g.channels)];
    sum += g.channels == 1 ? Rgb<double>(w * v[0]) : Rgb<double>(w * v[0], w * v[1], w * v[2]);
  }
  return sum;
}

Rgb<double> lookup(const AlbedoTable& table, const Model& m, const ParamValues& given, double cos_theta_o) {
  const ParamValues values = complete(m.info(), given);
  Rgb<double> sum(0);
  for (const AlbedoTerm& t : table.terms_for(m, values)) {
    const AlbedoGrid& g = table.grids.at(std::size_t(t.grid));
    std::vector<double> x;
    for (const TableAxis& a : g.axes)
      x.push_back(a.name == "cos_theta_o" ? cos_theta_o : std::get<double>(values.at(a.name)));
    Rgb<double> product = lookup(g, x);
    for (const std::string& c : t.colors) {
      const auto& v = std::get<std::array<double, 3>>(values.at(c));
      product = product * Rgb<double>(v[0], v[1], v[2]);
    }
    sum += product;
  }
  return sum;
}

}  // namespace brdfc::measure
