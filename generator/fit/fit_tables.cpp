// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/fit_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "fit/settings.h"
#include "fit/view_axis.h"
#include "tables/algebra.h"

namespace brdfc::fit {
namespace {

std::vector<double> rounded_all(std::vector<double> numbers) {
  for (double& x : numbers) x = rounded(x);
  return numbers;
}

}  // namespace

double rounded(double x) { return double(std::strtof(fmt::format("{:.6g}", x).c_str(), nullptr)); }

std::array<double*, 6> numbers_of(ViewError& e) {
  return {&e.cos_theta_o, &e.relative_l1, &e.relative_l2, &e.albedo, &e.negative, &e.number};
}

void FitTables::tabulate(const std::vector<double>& places, const std::vector<Solution>& solutions) {
  if (axis) {
    // Knots lie at multiples of 1 / steps, so that the map from a place to the index of its knot is linear between
    // them.
    constexpr int kSteps = int(kSettings.steps);
    std::vector<double> positions;
    for (int i = 0; i <= kSteps; ++i) {
      const double x = double(i) / kSteps;
      const auto above = std::size_t(std::max(std::ranges::lower_bound(places, x) - places.begin(), std::ptrdiff_t(1)));
      const double between = (x - places[above - 1]) / (places[above] - places[above - 1]);
      positions.push_back((double(above - 1) + between) / double(places.size() - 1));
    }
    position = make_table("position_on_axis", {even_axis("place_on_axis", kSteps + 1)}, std::move(positions));
  }
  lobes.clear();
  linear.clear();
  facets.clear();
  const std::vector<ViewSolution>& first_cells = solutions[0].views;
  const std::size_t term_count = terms.terms.size();
  const int count = int(solutions.size()), views = int(first_cells.size()),
            channels = int(first_cells[0].x.cols()) / int(term_count);
  const auto columns_of = [&](std::size_t term, const auto& m) {
    return m.middleCols(Eigen::Index(term) * channels, channels);
  };
  // The albedo of a term, as the mean over channels. Along an axis it may vary by orders of magnitude, so the colours
  // of closures are tabulated relative to it.
  const auto albedo_of = [&](const ViewSolution& c, std::size_t term) {
    return std::max((columns_of(term, c.view->f).transpose() * weights_of(c.view->points)).mean(), 1e-30);
  };
  const auto unit = [&](const ViewSolution& c, std::size_t term) { return axis ? albedo_of(c, term) : 1.0; };
  const auto name_of_term = [&](const std::string& name, std::size_t term) {
    return term_count == 1 ? name : fmt::format("{}_{}", name, term);
  };
  std::vector<TableAxis> over = {even_axis("place_of_view", views)};
  if (axis) over.insert(over.begin(), even_axis("knot", count));
  const auto table = [&](const std::string& name, const auto& value) {
    std::vector<double> numbers;
    for (const Solution& knot : solutions)
      for (const ViewSolution& c : knot.views) numbers.push_back(value(c));
    return make_table(name, over, rounded_all(numbers));
  };
  amplitude.clear();
  for (std::size_t t = 0; axis && t < term_count; ++t)
    amplitude.push_back(
        table(name_of_term("amplitude", t), [&](const ViewSolution& c) { return std::log(unit(c, t)); }));
  for (std::size_t i = 0; i < first_cells[0].facets.size(); ++i)
    facets.push_back(
        {first_cells[0].facets[i].kind,
         table(fmt::format("lean_of_{}", i), [&](const ViewSolution& c) { return c.facets[i].offset; }),
         table(fmt::format("alpha_of_{}", i), [&](const ViewSolution& c) { return std::log(c.facets[i].alpha); }),
         table(fmt::format("stretch_of_{}", i), [&](const ViewSolution& c) { return std::log(c.facets[i].stretch); })});
  const std::size_t lobe_count = first_cells[0].lobes.size(), closure_count = lobe_count + 1 + facets.size();
  for (std::size_t j = 0; j < lobe_count; ++j)
    lobes.push_back(
        {table(fmt::format("offset_of_{}", j),
               [&](const ViewSolution& c) { return c.lobes[j].offset * (axis ? std::sqrt(c.lobes[j].exponent) : 1); }),
         table(fmt::format("power_of_{}", j),
               [&](const ViewSolution& c) { return axis ? std::log(c.lobes[j].exponent) : c.lobes[j].exponent; })});
  for (std::size_t j = 0; j < closure_count; ++j) {
    const bool ramp = j <= lobe_count;
    const Eigen::Index first = Eigen::Index(ramp ? j * kRampSize : (lobe_count + 1) * kRampSize + (j - lobe_count - 1));
    const int entries = ramp ? kRampSize : 1;
    LinearTables l;
    for (std::size_t t = 0; t < term_count; ++t) {
      // The part of the albedo that facets leave is divided among the ramps in proportion to the sum of the absolute
      // values of their colours. So the weights add up to the albedo, which render passes and the denoiser use.
      if (ramp)
        l.weight.push_back(table(name_of_term(fmt::format("share_of_{}", j), t), [&](const ViewSolution& c) {
          const Eigen::MatrixXd x = columns_of(t, c.x);
          const Eigen::Index of_ramps = Eigen::Index((lobe_count + 1) * kRampSize);
          const double own = x.middleRows(first, entries).cwiseAbs().sum();
          const double all = std::max(x.topRows(of_ramps).cwiseAbs().sum(), 1e-300);
          const double albedo = albedo_of(c, t), of_facets = x.bottomRows(x.rows() - of_ramps).sum() / channels;
          return std::max(albedo - of_facets, (1 - kSettings.most_of_facets) * albedo) * (own / all + 1e-3) /
                 (1 + 1e-3 * double(lobe_count + 1)) / unit(c, t);
        }));
      l.colour.emplace_back();
      for (int channel = 0; channel < channels; ++channel) {
        const int column = int(t) * channels + channel;
        std::vector<double> numbers;
        for (const Solution& knot : solutions)
          for (const ViewSolution& c : knot.views)
            for (int k = 0; k < entries; ++k)
              numbers.push_back(c.x(first + k, column) / c.scale[first + k] / unit(c, t));
        std::vector<TableAxis> axes = over;
        if (ramp) axes.push_back(even_axis("position_in_ramp", kRampSize));
        l.colour[t].push_back(
            make_table(fmt::format("colour_of_{}_{}", j, column), std::move(axes), rounded_all(numbers)));
      }
    }
    linear.push_back(std::move(l));
  }
}

std::vector<TablePtr> FitTables::all() const {
  std::vector<TablePtr> out;
  const auto add = [&](const TablePtr& table) {
    if (table) out.push_back(table);
  };
  add(position);
  for (const auto& table : amplitude) add(table);
  for (const FacetTables& f : facets) add(f.offset), add(f.log_alpha), add(f.log_stretch);
  for (const LobeTables& l : lobes) add(l.offset), add(l.exponent);
  for (const LinearTables& l : linear) {
    for (const auto& table : l.weight) add(table);
    for (const auto& term : l.colour)
      for (const auto& channel : term) add(channel);
  }
  return out;
}

FitTables FitTables::cut_to(const Cosines& views) const {
  const auto knot = [](double cosine) { return view_place(direction(cosine, 0)) * (int(kSettings.views) - 1); };
  FitTables out = *this;
  const int first = std::min(int(std::floor(knot(views.high))), int(kSettings.views) - 2),
            last = std::clamp(int(std::ceil(knot(views.low))), first + 1, int(kSettings.views) - 1);
  out.first_view = double(first) / (int(kSettings.views) - 1);
  out.view_length = double(last - first) / (int(kSettings.views) - 1);
  const auto cut = [&](TablePtr& table) {
    table = std::make_shared<const Table>(part(*table, axis ? 1 : 0, first, last));
  };
  for (auto& table : out.amplitude) cut(table);
  for (LobeTables& l : out.lobes) cut(l.offset), cut(l.exponent);
  for (FacetTables& f : out.facets) cut(f.offset), cut(f.log_alpha), cut(f.log_stretch);
  for (LinearTables& l : out.linear) {
    for (auto& table : l.weight) cut(table);
    for (auto& term : l.colour)
      for (auto& channel : term) cut(channel);
  }
  // At least one error is kept.
  const double apart = errors[0].cos_theta_o - errors[1].cos_theta_o;
  std::erase_if(out.errors, [&](const ViewError& e) {
    return e.cos_theta_o < views.low - apart || e.cos_theta_o > views.high + apart;
  });
  return out;
}

void FitTables::multiply(const Rgb<double>& factor) {
  if (!axis) return;
  const Rgb<double> all = tint * factor;
  scale = std::max(max_component(all), 1e-30);
  tint = all / scale;
}

}  // namespace brdfc::fit
