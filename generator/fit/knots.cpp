// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/knots.h"

#include <algorithm>
#include <iterator>

#include "core/parallel.h"
#include "fit/settings.h"
#include "fit/view_axis.h"
#include "measure/probes.h"

namespace brdfc::fit {
bool Knots::see(const std::vector<double>& places) {
  std::vector<View> fresh;
  std::vector<double> at;
  for (const double x : places) {
    if (views_.count(x)) continue;
    at.push_back(x);
    std::ranges::move(views_at(x), std::back_inserter(fresh));
  }
  if (at.empty()) return true;
  if (grey_) {
    const std::optional<Rgb<double>> found = make_grey(fresh);
    if (!found || (tint_ && !(measure::relative(*found, *tint_) < 1e-6))) return false;
    tint_ = found;
  }
  for (std::size_t i = 0; i < at.size(); ++i) {
    const auto first = fresh.begin() + std::ptrdiff_t(i * kSettings.views);
    views_[at[i]].assign(std::make_move_iterator(first),
                         std::make_move_iterator(first + std::ptrdiff_t(kSettings.views)));
  }
  return true;
}

bool Knots::find_shapes() {
  const std::size_t last = along_.axis() ? kSettings.shape_places - 1 : 0, middle = last / 2;
  std::vector<double> places;
  for (std::size_t k = 0; k <= last; ++k) places.push_back(along_.axis() ? double(k) / double(last) : 0);
  if (!see(places)) return false;
  shapes_.assign(places.size(), std::vector<FacetShape>(kSettings.views / kSettings.shape_stride + 1, kFirstShape));
  const auto search = [&](std::size_t k, std::size_t v, const FacetShape& begin) {
    const std::vector<View>& seen = views(places[k]);
    shapes_[k][v] = improved(begin, seen[0].lobe, seen[v * kSettings.shape_stride]);
  };
  const auto error = [&](std::size_t v, const FacetShape& shape) {
    const std::vector<View>& seen = views(places[middle]);
    const View& view = seen[v * kSettings.shape_stride];
    return facet_error(facets_of(shape, seen[0].lobe, view.wo), view);
  };
  for (std::size_t v = 0; v < shapes_[middle].size(); ++v) {
    // A second search from the point where the first one ended, with large steps again, escapes many poor minima.
    for (int round = 0; round < int(kSettings.rounds); ++round)
      search(middle, v, round > 0 || v == 0 ? shapes_[middle][v] : shapes_[middle][v - 1]);
    for (std::size_t stretch = kNumbersOfFacet - 1; v > 0 && stretch < kFirstShape.size(); stretch += kNumbersOfFacet) {
      const FacetShape before = shapes_[middle][v];
      FacetShape begin = before;
      begin[stretch] = std::max(begin[stretch] - kSettings.flatter, -kSettings.most_stretch);
      search(middle, v, begin);
      if (!(error(v, shapes_[middle][v]) < kSettings.clearly_better * error(v, before))) shapes_[middle][v] = before;
    }
  }
  for_all(shapes_[middle].size(), [&](std::size_t v) {
    for (std::size_t k = middle + 1; k <= last; ++k) search(k, v, shapes_[k - 1][v]);
    for (std::size_t k = middle; k-- > 0;) search(k, v, shapes_[k + 1][v]);
  });
  return true;
}

std::vector<Solution> Knots::fitted(const std::vector<double>& places, std::size_t stride, Family family) const {
  std::vector<Solution> out(places.size());
  for_all(places.size(), [&](std::size_t i) {
    const double x = places[i];
    out[i] = solve_views(views_.at(x), stride, family, along_.terms(), [&](std::size_t view) {
      return family == Family::Microfacet ? shape(x, view) : FacetShape();
    });
  });
  return out;
}

FacetShape Knots::shape(double x, std::size_t view) const {
  const auto beside = [](double at, std::size_t count) {
    const std::size_t first = std::min(std::size_t(at), count < 2 ? 0 : count - 2);
    return std::pair(first, count < 2 ? 0 : at - double(first));
  };
  const auto [k, along] = beside(x * double(shapes_.size() - 1), shapes_.size());
  const auto [v, down] = beside(double(view) / kSettings.shape_stride, shapes_[0].size());
  FacetShape out = kFirstShape;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto at = [&, v = v, down = down](std::size_t place) {
      return shapes_[place][v][i] * (1 - down) + shapes_[place][v + 1][i] * down;
    };
    out[i] = at(k) * (1 - along) + (along > 0 ? at(k + 1) * along : 0);
  }
  return out;
}

std::vector<View> Knots::views_at(double x) const {
  const Along::At at(along_, x, kSettings.some);
  std::vector<View> views(kSettings.views);
  for_all(kSettings.views, [&](std::size_t i) {
    views[i] = at.view(view_at(double(i) / double(kSettings.views - 1)), int(kSettings.points));
  });
  return views;
}

}  // namespace brdfc::fit
