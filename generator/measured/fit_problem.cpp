// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/fit_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/sequence.h"
#include "measured/least_deviations.h"

namespace brdfc::measured {
namespace {

bool differ(const Colors& a, const Colors& b, double share = 1e-6) {
  double off = 0, most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    off = std::max(off, max_component(magnitude(a[k] - b[k])));
    most = std::max(most, max_component(magnitude(a[k])));
  }
  return off > share * most;
}

}  // namespace

bool is_circle(const ParamInfo& p) { return p.unit == "rad" && p.soft_max - p.soft_min > 2 * kPi - 1e-6; }

bool Searched::stopped(double t) const {
  constexpr double kNear = 1e-3;
  const double first = range.first(), last = range.last();
  const bool at_first = t - first < kNear, at_last = last - t < kNear;
  if (is_circle(*info)) return false;
  if (scale == AxisScale::Log) return at_first || at_last;
  if (scale == AxisScale::Log1p) return at_last;
  return (at_first && range.at(first) > info->min) || (at_last && range.at(last) < info->max);
}

SearchRange Searched::range_of(const ParamInfo& p) {
  const ScaledRange slider = p.slider();
  double least = slider.low, most = slider.high;
  switch (slider.scale) {
    case AxisScale::Log:
      least /= kBeyond, most *= kBeyond;
      break;
    case AxisScale::Log1p:
      most *= kBeyondExponent;
      break;
    case AxisScale::Linear:
      // More than the whole circle is the same again.
      if (const double width = most - least; !is_circle(p)) least -= width, most += width;
  }
  return {slider, std::max(p.min, least), std::min(p.max, most)};
}

Problem::Problem(const Model& model, const ParamValues& choices, Axes axes, const Pairs& pairs)
    : info_(model.info()), values_(complete(info_, choices)), brdf_(model.make_double(values_)) {
  for (const ParamInfo& p : info_.params)
    if (p.kind == ParamKind::Color) colors_.push_back(&p);
  if (brdf_->scatters_through()) return;
  std::vector<const ParamInfo*> numbers;
  // Isotropic data say nothing of an angle about the normal, which isotropic models do not have. Where the data's
  // axes are the tangent and the bitangent, no rotation is needed.
  const auto turns_nothing = [&](const ParamInfo& p) {
    if (p.unit != "rad" || info_.properties.isotropic) return false;
    return axes == Axes::None || (axes == Axes::Aligned && is_circle(p));
  };
  for (const ParamInfo& p : info_.params)
    if (p.kind == ParamKind::Number && !turns_nothing(p)) numbers.push_back(&p);
  for (const ParamInfo* p : numbers) {
    if (!matters(*p, numbers, pairs)) {
      without_mirror(*p);
      continue;
    }
    // A number that only scales what a colour scales as well is left to the colour.
    if (std::ranges::any_of(colors_, [&](const ParamInfo* c) { return p->max == 1 && same_at_zero(*p, *c, pairs); }))
      set(*p, 1);
    else
      searched_.emplace_back(*p);
  }
}

void Problem::set_numbers(const std::vector<double>& t) {
  for (std::size_t i = 0; i < searched_.size(); ++i) set(*searched_[i].info, searched_[i].range.at(t[i]));
}

/// How f at the base changes with each colour, in the same unit for all channels. `near`: over a short step, for
/// colours that f is not linear in.
std::vector<Colors> Problem::slopes(const Pairs& p, const Found& base, const Colors& at_base, bool near) {
  std::vector<Colors> out;
  for (std::size_t j = 0; j < colors_.size(); ++j) {
    Rgb<double> end(0);
    for (std::size_t c = 0; c < 3; ++c) {
      const double x = channel(base[j], c);
      const bool up = x < 0.5;
      set_channel(end, c, near ? x + (up ? 0.01 : -0.01) : up);
    }
    set(*colors_[j], end);
    out.push_back(eval(p));
    set(*colors_[j], base[j]);
    for (std::size_t k = 0; k < out.back().size(); ++k)
      for (std::size_t c = 0; c < 3; ++c)
        set_channel(out.back()[k], c,
                    (channel(out.back()[k], c) - channel(at_base[k], c)) / (channel(end, c) - channel(base[j], c)));
  }
  return out;
}

/// Finds the colours, and the matte light if there is room for it in `found`, as if f were linear in the colours about
/// the base. Returns f without the matte light, if it is.
Colors Problem::solve_linear(const Pairs& p, const Found& base, bool near, Found& found) {
  const std::size_t count = p.wi.size(), n = colors_.size();
  double mean = 0;
  for (std::size_t k = 0; k < count; ++k) mean += luminance(p.data[k]) / double(count);
  set_colors(base);
  const Colors at_base = eval(p);
  const std::vector<Colors> slope = slopes(p, base, at_base, near);
  Colors linear(count);
  for (std::size_t c = 0; c < 3; ++c) {
    Eigen::MatrixXd columns(count, found.size());
    Eigen::VectorXd target(count);
    for (std::size_t k = 0; k < count; ++k) {
      const auto row = Eigen::Index(k);
      target[row] = channel(p.data[k], c) - channel(at_base[k], c);
      for (std::size_t j = 0; j < n; ++j) {
        columns(row, Eigen::Index(j)) = channel(slope[j][k], c);
        target[row] += channel(slope[j][k], c) * channel(base[j], c);
      }
      if (found.size() > n) columns(row, Eigen::Index(n)) = 1 / kPi;
    }
    const auto size = Eigen::Index(found.size());
    const Eigen::VectorXd x = least_deviations(columns, target, p.weight, mean, Eigen::VectorXd::Ones(size));
    for (std::size_t j = 0; j < found.size(); ++j) set_channel(found[j], c, x[Eigen::Index(j)]);
    const Eigen::VectorXd of_colors = columns.leftCols(Eigen::Index(n)) * x.head(Eigen::Index(n));
    for (std::size_t k = 0; k < count; ++k)
      set_channel(linear[k], c, channel(p.data[k], c) - target[Eigen::Index(k)] + of_colors[Eigen::Index(k)]);
  }
  return linear;
}

double Problem::solve(const Pairs& p, std::optional<Rgb<double>>& matte) {
  const std::size_t n = colors_.size();
  Found found(n + (matte ? 1 : 0), Rgb<double>(0.5)), best_found = found;
  double best = std::numeric_limits<double>::infinity();
  Colors f;
  const auto error_of_found = [&] {
    set_colors(found);
    f = eval(p);
    if (!matte) return error_of(p, f);
    Colors both = f;
    for (Rgb<double>& v : both) v += found[n] / kPi;
    return error_of(p, both);
  };
  // Colours that f is far from linear in, as Hapke's, take further rounds, of which each must pay.
  bool pays = false;
  for (int round = 0; round < (n ? 3 : 1) || (pays && round < 12); ++round) {
    const Found base = round == 0 ? Found(n, Rgb<double>(0)) : found;
    const Colors linear = solve_linear(p, base, round > 0, found);
    double error = error_of_found();
    // As it is in most: another round would find the same colours.
    const bool settled = !differ(f, linear, 1e-9);
    // Where f is curved, a step may go too far.
    for (int i = 0; i < 4 && n > 0 && error > 1.1 * best; ++i) {
      for (std::size_t j = 0; j < n; ++j) found[j] = (found[j] + best_found[j]) * 0.5;
      error = error_of_found();
    }
    pays = error < 0.9 * best;
    if (!(error < best * (1 - 1e-6))) break;
    best = error;
    best_found = found;
    if (settled) break;
  }
  set_colors(best_found);
  if (matte && std::isfinite(best)) matte = best_found[n];
  return std::isfinite(best) ? best : std::numeric_limits<double>::infinity();
}

double Problem::mirror() const {
  constexpr int kViews = 16;
  double light = 0;
  for (int i = 0; i < kViews; ++i) {
    const double z = (i + 0.5) / kViews;
    const Rgb<double> m = brdf_->mirror({std::sqrt(1 - z * z), 0, z});
    light += (m.r + m.g + m.b) / 3 * 2 * z / kViews;
  }
  return light;
}

Colors Problem::eval(const Pairs& p) const {
  Colors out(p.wi.size());
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = brdf_->eval(p.wi[k], p.wo[k]);
  return out;
}

void Problem::set(const ParamInfo& p, double value) {
  values_[p.name] = value;
  brdf_->assign(p.name, {value, value, value});
}

void Problem::set(const ParamInfo& p, const Rgb<double>& value) {
  values_[p.name] = std::array<double, 3>{value.r, value.g, value.b};
  brdf_->assign(p.name, {value.r, value.g, value.b});
}

/// Sets the colours; what is left of `found` is none of theirs.
void Problem::set_colors(const Found& found) {
  for (std::size_t j = 0; j < colors_.size(); ++j) set(*colors_[j], found[j]);
}

/// A number that f does not depend on gets its least value if there is less of a mirror then.
void Problem::without_mirror(const ParamInfo& p) {
  const double before = std::get<double>(values_.at(p.name)), had = mirror();
  set(p, p.min);
  if (!(mirror() < had)) set(p, before);
}

/// Whether f depends on a number, with the others at their defaults or elsewhere.
bool Problem::matters(const ParamInfo& p, const std::vector<const ParamInfo*>& numbers, const Pairs& pairs) {
  const ParamValues before = values_;
  bool found = false;
  for (const double others : {-1., 0.3, 0.7}) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (others >= 0) set(*numbers[i], numbers[i]->slider().at(wrap(others + 0.37 * double(i))));
    set(p, p.slider().at(0.25));
    const Colors low = eval(pairs);
    // The halves of a circle may be alike.
    for (const double place : {0.75, 0.6}) {
      if (found) break;
      set(p, p.slider().at(place));
      found = differ(low, eval(pairs));
    }
    for (const ParamInfo* q : numbers) set(*q, std::get<double>(before.at(q->name)));
  }
  return found;
}

bool Problem::same_at_zero(const ParamInfo& p, const ParamInfo& color, const Pairs& pairs) {
  if (p.min > 0) return false;
  const double before = std::get<double>(values_.at(p.name));
  const auto c = std::get<std::array<double, 3>>(values_.at(color.name));
  set(p, 0);
  const Colors without = eval(pairs);
  set(p, 1);
  set(color, Rgb<double>(0));
  const bool same = !differ(eval(pairs), without);
  // Also half of the one is as much as half of the other.
  set(p, 0.5), set(color, Rgb<double>(1));
  const Colors half = eval(pairs);
  set(p, 1), set(color, Rgb<double>(0.5));
  const bool both = same && !differ(eval(pairs), half);
  set(p, before), set(color, Rgb<double>(c[0], c[1], c[2]));
  return both;
}

}  // namespace brdfc::measured
