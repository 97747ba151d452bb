// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/fold.h"

#include <algorithm>
#include <array>
#include <map>
#include <string>

#include "model/choices.h"
#include "tables/algebra.h"

namespace brdfc::measure {
namespace {

/// Removes the knots of the view angle that interpolation within `views` does not need.
Table cut_to(const Table& grid, const Cosines& views) {
  if (grid.axes.empty() || grid.axes[0].name != "cos_theta_o") return grid;
  const std::vector<double>& knots = grid.axes[0].values;
  const int last_knot = grid.axes[0].size() - 1;
  const int first = std::clamp(int(std::ranges::upper_bound(knots, views.low) - knots.begin()) - 1, 0, last_knot - 1);
  const int last = std::clamp(int(std::ranges::lower_bound(knots, views.high) - knots.begin()), first + 1, last_knot);
  return part(grid, 0, first, last);
}

std::map<std::string, double> numbers_in(const ParamValues& values) {
  std::map<std::string, double> out;
  for (const auto& [name, value] : values)
    if (const double* number = std::get_if<double>(&value)) out.emplace(name, *number);
  return out;
}

Rgb<double> color_of(const ParamValue& value) {
  const auto& [r, g, b] = std::get<std::array<double, 3>>(value);
  return {r, g, b};
}

}  // namespace

AlbedoTable fold(const AlbedoTable& table, const Model& model, const ParamValues& fixed, const Cosines& views) {
  if (fixed.empty() && views.all()) return table;
  AlbedoTable out = table;
  out.grids.clear();
  const std::map<std::string, double> numbers = numbers_in(fixed);
  const std::vector<Choices> combinations = choice_combinations(model.info());
  for (std::size_t i = 0; i < combinations.size(); ++i) {
    std::vector<AlbedoTerm> terms;
    if (admits(model.info(), combinations[i], fixed)) {
      // Merges terms with the same free colours over the same axes.
      std::vector<std::pair<AlbedoTerm, Table>> parts;
      for (const AlbedoTerm& t : table.terms.at(i)) {
        AlbedoTerm term = t;
        Table grid = sliced(cut_to(table.grids.at(std::size_t(t.grid)), views), numbers);
        term.colors.clear();
        for (const std::string& c : t.colors) {
          const auto it = fixed.find(c);
          if (it == fixed.end())
            term.colors.push_back(c);
          else
            multiply(grid, color_of(it->second));
        }
        const auto like = std::find_if(parts.begin(), parts.end(), [&](const auto& p) {
          return p.first.colors == term.colors && p.first.mirror == term.mirror && p.second.axes == grid.axes;
        });
        if (like == parts.end())
          parts.emplace_back(term, std::move(grid));
        else
          add(like->second, grid);
      }
      for (auto& [term, grid] : parts) {
        if (std::all_of(grid.values.begin(), grid.values.end(), [](double v) { return v == 0; })) continue;
        const auto known = std::find_if(out.grids.begin(), out.grids.end(), [&, &g = grid](const Table& k) {
          return k.channels == g.channels && k.values == g.values && k.axes == g.axes;
        });
        term.grid = int(known - out.grids.begin());
        if (known == out.grids.end()) out.grids.push_back(std::move(grid));
        terms.push_back(term);
      }
    }
    out.terms[i] = std::move(terms);
  }
  return out;
}

}  // namespace brdfc::measure
