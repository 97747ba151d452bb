// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/fold.h"

#include <algorithm>

#include "model/choices.h"

namespace brdfc::measure {
namespace {

/// The knots over the view that `views` lie between, as lookup() takes them.
AlbedoGrid seen(const AlbedoGrid& grid, const Cosines& views) {
  AlbedoGrid out = grid;
  if (grid.axes.empty() || grid.axes[0].name != "cos_theta_o") return out;
  const std::vector<double>& knots = grid.axes[0].values;
  const auto last_knot = std::ptrdiff_t(knots.size()) - 1;
  const auto first =
      std::clamp(std::ranges::upper_bound(knots, views.low) - knots.begin() - 1, std::ptrdiff_t(0), last_knot - 1);
  const auto last = std::clamp(std::ranges::lower_bound(knots, views.high) - knots.begin(), first + 1, last_knot);
  const auto row = std::ptrdiff_t(grid.values.size() / knots.size());
  out.axes[0].values.assign(knots.begin() + first, knots.begin() + last + 1);
  out.values.assign(grid.values.begin() + first * row, grid.values.begin() + (last + 1) * row);
  return out;
}

/// The grid at fixed coordinates: linear between two knots of the axis' scale, as lookup() does.
AlbedoGrid sliced(const AlbedoGrid& grid, const ParamValues& fixed) {
  AlbedoGrid out;
  out.channels = grid.channels;
  out.error = grid.error;
  for (const TableAxis& axis : grid.axes)
    if (!fixed.count(axis.name)) out.axes.push_back(axis);
  std::vector<std::size_t> index(out.axes.size(), 0);
  for (bool more = true; more;) {
    std::vector<double> x;
    std::size_t kept = 0;
    for (const TableAxis& axis : grid.axes) {
      const auto it = fixed.find(axis.name);
      x.push_back(it == fixed.end() ? axis.values[index[kept]] : std::get<double>(it->second));
      if (it == fixed.end()) ++kept;
    }
    const Rgb<double> v = lookup(grid, x);
    out.values.push_back(float(v.r));
    if (grid.channels == 3) {
      out.values.push_back(float(v.g));
      out.values.push_back(float(v.b));
    }
    more = false;
    for (std::size_t a = out.axes.size(); a-- > 0 && !more;) {
      more = ++index[a] < out.axes[a].values.size();
      if (!more) index[a] = 0;
    }
  }
  return out;
}

void multiply(AlbedoGrid& grid, const std::array<double, 3>& color) {
  if (grid.channels == 1 && color[0] == color[1] && color[1] == color[2]) {
    for (float& v : grid.values) v = float(v * color[0]);
    return;
  }
  std::vector<float> values;
  const std::size_t step = std::size_t(grid.channels);
  for (std::size_t i = 0; i < grid.values.size(); i += step)
    for (std::size_t c = 0; c < 3; ++c) values.push_back(float(grid.values[i + (step == 1 ? 0 : c)] * color[c]));
  grid.channels = 3;
  grid.values = std::move(values);
}

bool same_axes(const AlbedoGrid& a, const AlbedoGrid& b) {
  return std::equal(a.axes.begin(), a.axes.end(), b.axes.begin(), b.axes.end(),
                    [](const TableAxis& p, const TableAxis& q) {
                      return p.name == q.name && p.scale == q.scale && p.values == q.values;
                    });
}

void add(AlbedoGrid& sum, AlbedoGrid other) {
  if (sum.channels != other.channels) {
    AlbedoGrid& grey = sum.channels == 1 ? sum : other;
    std::vector<float> values;
    for (const float v : grey.values) values.insert(values.end(), 3, v);
    grey.channels = 3;
    grey.values = std::move(values);
  }
  for (std::size_t i = 0; i < sum.values.size(); ++i) sum.values[i] += other.values[i];
  sum.error += other.error;
}

}  // namespace

AlbedoTable fold(const AlbedoTable& table, const Model& model, const ParamValues& fixed, const Cosines& views) {
  if (fixed.empty() && views.all()) return table;
  AlbedoTable out = table;
  out.grids.clear();
  const std::vector<Choices> combinations = choice_combinations(model.info());
  for (std::size_t i = 0; i < combinations.size(); ++i) {
    std::vector<AlbedoTerm> terms;
    if (admits(model.info(), combinations[i], fixed)) {
      // Terms with the same free colours over the same axes are one.
      std::vector<std::pair<AlbedoTerm, AlbedoGrid>> parts;
      for (const AlbedoTerm& t : table.terms.at(i)) {
        AlbedoTerm term = t;
        AlbedoGrid grid = sliced(seen(table.grids.at(std::size_t(t.grid)), views), fixed);
        term.colors.clear();
        for (const std::string& c : t.colors) {
          const auto it = fixed.find(c);
          if (it == fixed.end())
            term.colors.push_back(c);
          else
            multiply(grid, std::get<std::array<double, 3>>(it->second));
        }
        const auto like = std::find_if(parts.begin(), parts.end(), [&](const auto& p) {
          return p.first.colors == term.colors && p.first.mirror == term.mirror && same_axes(p.second, grid);
        });
        if (like == parts.end())
          parts.emplace_back(term, std::move(grid));
        else
          add(like->second, std::move(grid));
      }
      for (auto& [term, grid] : parts) {
        if (std::all_of(grid.values.begin(), grid.values.end(), [](float v) { return v == 0; })) continue;
        const auto known = std::find_if(out.grids.begin(), out.grids.end(), [&, &g = grid](const AlbedoGrid& k) {
          return k.channels == g.channels && k.values == g.values && same_axes(k, g);
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
