// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/fit_factors.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "core/parallel.h"
#include "fit/view.h"
#include "measured/least_deviations.h"

namespace brdfc::measured {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Shapes (widening, heights) that are tried first: of facets, about the mirror direction, of the projected difference
/// to it, of equal heights, narrow at grazing angles.
constexpr std::array<std::array<double, 2>, 5> kShapes = {{{0, 0}, {2, 0.5}, {2, 0}, {4, 1}, {-2, 0}}};
/// A shape as near to one of them becomes that one, if the error is at most so many times as large.
constexpr double kBesideShape = 0.1, kAsGood = 1.01;
/// Roughnesses that are tried: of one, of one with the other shapes, and of each of two.
constexpr int kPlaces = 19, kPlacesOfOthers = 11, kPlacesEach = 7;
constexpr std::size_t kStarts = 3;  ///< searches begin at the best of them
constexpr double kSmoothest = 0.0005, kRoughest = 1;
constexpr int kFewSteps = 12, kSteps = 60;  ///< of the search for heights
/// Heights of colours are searched between the exponentials of these: wider than single precision tells from 0
/// beside 1. The heights that channels share are shadowing, which is seldom less.
constexpr double kRange = 34, kSharedRange = 12;
/// Of the deviations, the least that counts in the weights, in units of the mean of the data.
constexpr double kFirstFloor = 0.3, kLastFloor = 3e-3;
/// Where the data say nothing, curves go on straight in the logarithm, and become flat.
constexpr double kStiffness = 1e-4, kFlatness = 1e-6;

/// What the highlight's first curve is a function of.
struct CurveLobe {
  std::vector<double> roughness;
  std::vector<double> shape;
};

/// What pairs of directions determine, for any lobe.
struct Fixed {
  MatrixXd power;  ///< of the heights beyond the first curve, a row for each pair
  MatrixXd matte;  ///< of a white surface: coefficients of 1, the rim and its square
};

/// The highlight's powers and the rest of it, for pairs of directions and a lobe.
struct Powers {
  VectorXd unit;   ///< f with all heights and the strength 1, and without matte light
  MatrixXd power;  ///< of each height, a row for each pair
};

class Curves {
 public:
  Curves(const Model& model, const CurveRoles& roles)
      : model_(model), roles_(roles), values_(complete(model.info(), {})) {
    set(*roles_.matte, 0);
    set(*roles_.rim, 0);
    set(*roles_.strength, 1);
    for (const auto* heights : {&roles_.colors, &roles_.numbers})
      for (const ParamInfo* p : *heights) set(*p, 1);
  }

  Fixed fixed(const Pairs& pairs) const {
    const Index count = Index(pairs.wi.size()), first = in_lobe();
    Fixed out{MatrixXd(count, heights() - first), MatrixXd(count, 3)};
    const auto brdf = model_.make_double(values_);
    const VectorXd unit = f(*brdf, pairs);
    for (Index k = first; k < heights(); ++k) out.power.col(k - first) = power(*brdf, pairs, unit, k);
    brdf->assign(roles_.strength->name, {0, 0, 0});
    brdf->assign(roles_.matte->name, {1, 1, 1});
    const auto at = [&](double rim) {
      brdf->assign(roles_.rim->name, {rim, rim, rim});
      return f(*brdf, pairs);
    };
    const VectorXd none = at(0), half = at(0.5), whole = at(1);
    out.matte << none, 4 * half - 3 * none - whole, 2 * (whole + none) - 4 * half;
    return out;
  }
  Powers powers(const CurveLobe& lobe, const Fixed& fixed, const Pairs& pairs) const {
    const auto brdf = model_.make_double(at(lobe));
    Powers out{f(*brdf, pairs), MatrixXd(Index(pairs.wi.size()), heights())};
    const Index first = in_lobe();
    for (Index k = 0; k < first; ++k) out.power.col(k) = power(*brdf, pairs, out.unit, k);
    out.power.rightCols(heights() - first) = fixed.power;
    return out;
  }
  Index heights() const { return Index(roles_.colors.size() + roles_.numbers.size()); }
  Index own() const { return Index(roles_.colors.size()); }
  /// How many heights are of the first curve.
  Index in_lobe() const { return curves().front().second; }

  /// Heights of 1 at most, the rest of them in the strength, and the colour in the second curve: a factor of one curve
  /// and its inverse of the other leave f as it is. `logs`: of the heights, a column for each channel.
  ParamValues values(const CurveLobe& lobe, MatrixXd logs, const Rgb<double>& matte, double rim) const {
    ParamValues out = at(lobe);
    out[roles_.matte->name] = std::array<double, 3>{matte.r, matte.g, matte.b};
    out[roles_.rim->name] = rim;
    const auto of_colors = curves();
    const auto [first_row, first_end] = of_colors[0];
    Index brightest;
    logs.middleRows(first_row, first_end - first_row).rowwise().mean().maxCoeff(&brightest);
    for (Index c = 0; c < 3; ++c) {
      const double shift = logs(first_row + brightest, c);
      logs.col(c).segment(first_row, first_end - first_row).array() -= shift;
      logs.col(c).segment(of_colors[1].first, of_colors[1].second - of_colors[1].first).array() += shift;
    }
    double strength = 0;
    for (const auto& [first, end] : of_colors) {
      const double highest = logs.middleRows(first, end - first).maxCoeff();
      logs.middleRows(first, end - first).array() -= highest;
      strength += highest;
    }
    Index row = 0;
    for (const ParamInfo* p : roles_.colors) {
      std::array<double, 3>& height = std::get<std::array<double, 3>>(out[p->name]);
      for (std::size_t c = 0; c < 3; ++c) height[c] = std::exp(logs(row, Index(c)));
      ++row;
    }
    for (const ParamInfo* p : roles_.numbers) out[p->name] = std::exp(logs(row++, 0));
    out[roles_.strength->name] = std::exp(strength);
    return out;
  }

  /// Matte light alone.
  ParamValues matte_alone(const Pairs& pairs) const {
    ParamValues out = values_;
    out[roles_.strength->name] = 0.;
    std::array<double, 3>& rho = std::get<std::array<double, 3>>(out[roles_.matte->name]);
    const Index count = Index(pairs.data.size());
    const MatrixXd column = MatrixXd::Constant(count, 1, 1 / kPi);
    for (std::size_t c = 0; c < 3; ++c) {
      VectorXd target(count);
      for (Index k = 0; k < count; ++k) target[k] = channel(pairs.data[std::size_t(k)], c);
      rho[c] = least_deviations(column, target, pairs.weight, target.mean(), VectorXd::Ones(1))[0];
    }
    return out;
  }

  /// The rows of each curve of colours: heights whose names differ in their numbers alone.
  std::vector<std::pair<Index, Index>> curves() const {
    const auto stem = [](const ParamInfo* p) { return p->name.substr(0, p->name.find_first_of("0123456789")); };
    std::vector<std::pair<Index, Index>> out;
    for (std::size_t i = 0; i < roles_.colors.size(); ++i) {
      if (i == 0 || stem(roles_.colors[i]) != stem(roles_.colors[i - 1])) out.emplace_back(Index(i), Index(i));
      out.back().second = Index(i) + 1;
    }
    return out;
  }

 private:
  ParamValues at(const CurveLobe& lobe) const {
    ParamValues out = values_;
    for (std::size_t i = 0; i < lobe.roughness.size(); ++i) out[roles_.roughness[i]->name] = lobe.roughness[i];
    for (std::size_t i = 0; i < lobe.shape.size(); ++i) out[roles_.shape[i]->name] = lobe.shape[i];
    return out;
  }
  VectorXd power(Brdf<double>& brdf, const Pairs& pairs, const VectorXd& unit, Index k) const {
    const ParamInfo& p = k < own() ? *roles_.colors[std::size_t(k)] : *roles_.numbers[std::size_t(k - own())];
    constexpr double kLess = 0.5;
    brdf.assign(p.name, {kLess, kLess, kLess});
    const VectorXd out = ((f(brdf, pairs).array() / unit.array()).log() / std::log(kLess)).matrix();
    brdf.assign(p.name, {1, 1, 1});
    return out;
  }
  static VectorXd f(const Brdf<double>& brdf, const Pairs& pairs) {
    VectorXd out(Index(pairs.wi.size()));
    for (std::size_t k = 0; k < pairs.wi.size(); ++k) out[Index(k)] = brdf.eval(pairs.wi[k], pairs.wo[k]).g;
    return out;
  }
  void set(const ParamInfo& p, double value) {
    if (p.kind == ParamKind::Color)
      values_[p.name] = std::array<double, 3>{value, value, value};
    else
      values_[p.name] = value;
  }

  const Model& model_;
  const CurveRoles& roles_;
  ParamValues values_;
};

/// Heights and matte light for a given lobe. Unknowns: for each channel matte light and the logarithms of its heights,
/// then those of the heights that all three share, and the matte light's rim.
class Heights {
 public:
  Heights(const Curves& curves, const CurveLobe& lobe, const Fixed& fixed, const Pairs& pairs)
      : curves_(curves), fixed_(fixed), pairs_(pairs), p_(curves.powers(lobe, fixed, pairs)), own_(curves.own() + 1) {
    const Index count = p_.power.rows();
    for (Index k = 0; k < count; ++k) {
      std::vector<Index> used;
      for (Index j = 0; j < p_.power.cols(); ++j)
        if (std::abs(p_.power(k, j)) > 1e-9) used.push_back(j);
      used_.push_back(std::move(used));
    }
    double weight = 0, sum = 0;
    for (std::size_t k = 0; k < pairs.data.size(); ++k) {
      const double w = pairs.weight[Index(k)];
      weight += 3 * w, sum += w * (pairs.data[k].r + pairs.data[k].g + pairs.data[k].b);
    }
    mean_ = sum / weight;
  }

  /// Searches from both guesses for the matte light.
  void solve(int steps) {
    double best = std::numeric_limits<double>::infinity();
    VectorXd best_x;
    for (const double share : {0., 0.9}) {
      const VectorXd x = descend(guess(share), steps);
      const double e = error(x);
      if (!(e < best)) continue;
      best = e, best_x = x;
    }
    x_ = best_x, error_ = best;
  }
  double error() const { return error_; }

  Rgb<double> matte() const { return {x_[0], x_[own_], x_[2 * own_]}; }
  double rim() const { return x_[x_.size() - 1]; }
  MatrixXd logs() const {
    MatrixXd out(p_.power.cols(), 3);
    for (Index c = 0; c < 3; ++c)
      for (Index j = 0; j < out.rows(); ++j) out(j, c) = x_[place(j, c)];
    return out;
  }

 private:
  Index unknowns() const { return 3 * own_ + p_.power.cols() - (own_ - 1) + 1; }
  /// Where the height j of channel c stands among the unknowns.
  Index place(Index j, Index c) const { return j < own_ - 1 ? c * own_ + 1 + j : 3 * own_ + j - (own_ - 1); }

  double highlight(const VectorXd& x, std::size_t k, Index c) const {
    double sum = 0;
    for (const Index j : used_[k]) sum += p_.power(Index(k), j) * x[place(j, c)];
    return p_.unit[Index(k)] * std::exp(sum);
  }
  /// The matte light of a white surface, and its slope by the rim.
  std::pair<double, double> white(const VectorXd& x, std::size_t k) const {
    const auto m = fixed_.matte.row(Index(k));
    const double rim = x[x.size() - 1];
    return {m[0] + rim * (m[1] + rim * m[2]), m[1] + 2 * rim * m[2]};
  }
  double error(const VectorXd& x) const {
    double off = 0;
    for (std::size_t k = 0; k < used_.size(); ++k) {
      const double matte = white(x, k).first;
      for (Index c = 0; c < 3; ++c)
        off += pairs_.weight[Index(k)] *
               std::abs(x[c * own_] * matte + highlight(x, k, c) - channel(pairs_.data[k], std::size_t(c)));
    }
    return off / pairs_.light;
  }

  /// Where curves bend, the change of slope at a knot, and where they are not flat: for each curve of each channel.
  void add_stiffness(MatrixXd& a, VectorXd& b, const VectorXd& x, double strength, double flatness) const {
    const auto rise = [&](Index i, Index j) {
      const double r = flatness * (x[j] - x[i]);
      b[i] += r, b[j] -= r;
      a(i, i) += flatness, a(j, j) += flatness, a(i, j) -= flatness, a(j, i) -= flatness;
    };
    const auto bend = [&](Index i, Index j, Index k) {
      const double r = x[i] - 2 * x[j] + x[k];
      const std::array<std::pair<Index, double>, 3> d{{{i, 1}, {j, -2}, {k, 1}}};
      for (const auto& [p, u] : d) {
        b[p] -= strength * u * r;
        for (const auto& [q, v] : d) a(p, q) += strength * u * v;
      }
    };
    for (const auto& [first, end] : curves_.curves())
      for (Index c = 0; c < 3; ++c)
        for (Index j = first + 1; j < end; ++j) {
          rise(place(j - 1, c), place(j, c));
          if (j + 1 < end) bend(place(j - 1, c), place(j, c), place(j + 1, c));
        }
  }

  void keep_in_range(VectorXd& x) const {
    for (Index i = 0; i < x.size(); ++i) {
      const bool is_matte = i < 3 * own_ && i % own_ == 0, is_shared = i >= 3 * own_;
      if (is_matte || i + 1 == x.size())
        x[i] = std::clamp(x[i], 0., 1.);
      else
        x[i] = std::clamp(x[i], is_shared ? -kSharedRange : -kRange, is_shared ? 0. : kRange);
    }
  }

  /// The logarithm of what the matte light leaves, by weighted least squares.
  VectorXd guess(double share) const {
    VectorXd x = VectorXd::Zero(unknowns());
    MatrixXd a = MatrixXd::Zero(x.size(), x.size());
    VectorXd b = VectorXd::Zero(x.size());
    for (Index c = 0; c < 3; ++c) {
      std::vector<double> sorted;
      for (const Rgb<double>& d : pairs_.data) sorted.push_back(channel(d, std::size_t(c)));
      std::ranges::nth_element(sorted, sorted.begin() + long(sorted.size() / 20));
      const double matte = std::clamp(share * kPi * sorted[sorted.size() / 20], 0., 1.);
      x[c * own_] = matte;
      for (std::size_t k = 0; k < used_.size(); ++k) {
        const double d = channel(pairs_.data[k], std::size_t(c)), rest = std::max(d - matte / kPi, 0.05 * d);
        if (!(rest > 0)) continue;
        const double w = pairs_.weight[Index(k)] * rest / pairs_.light;
        const double target = std::log(rest / p_.unit[Index(k)]);
        for (const Index i : used_[k]) {
          b[place(i, c)] += w * p_.power(Index(k), i) * target;
          for (const Index j : used_[k])
            a(place(i, c), place(j, c)) += w * p_.power(Index(k), i) * p_.power(Index(k), j);
        }
      }
    }
    add_stiffness(a, b, x, 1e-3, 0);
    for (Index i = 0; i < x.size(); ++i) a(i, i) += 1e-6;
    const VectorXd found = a.ldlt().solve(b);
    for (Index i = 0; i < x.size(); ++i)
      if (!(i < 3 * own_ && i % own_ == 0)) x[i] = found[i];
    x[x.size() - 1] = 0;
    keep_in_range(x);
    return x;
  }

  /// K. Levenberg, D. Marquardt's method, with weights that make squares absolute deviations.
  VectorXd descend(VectorXd x, int steps) const {
    double damping = 1e-3, now = error(x);
    for (int step = 0; step < steps; ++step) {
      const double floor = mean_ * kFirstFloor * std::pow(kLastFloor / kFirstFloor, std::min(1., 1.5 * step / steps));
      MatrixXd a = MatrixXd::Zero(x.size(), x.size());
      VectorXd b = VectorXd::Zero(x.size());
      std::vector<std::pair<Index, double>> slope;
      for (std::size_t k = 0; k < used_.size(); ++k)
        for (Index c = 0; c < 3; ++c) {
          const double high = highlight(x, k, c);
          const auto [matte, by_rim] = white(x, k);
          const double r = x[c * own_] * matte + high - channel(pairs_.data[k], std::size_t(c));
          const double w = pairs_.weight[Index(k)] / (pairs_.light * std::max(std::abs(r), floor));
          slope.assign({{c * own_, matte}, {x.size() - 1, x[c * own_] * by_rim}});
          for (const Index j : used_[k]) slope.emplace_back(place(j, c), high * p_.power(Index(k), j));
          for (const auto& [i, u] : slope) {
            b[i] -= w * u * r;
            for (const auto& [j, v] : slope) a(i, j) += w * u * v;
          }
        }
      add_stiffness(a, b, x, kStiffness, kFlatness);
      const Index rim = x.size() - 1;
      a(rim, rim) += kFlatness, b[rim] -= kFlatness * x[rim];
      bool better = false;
      for (int tries = 0; tries < 6 && !better; ++tries) {
        MatrixXd damped = a;
        for (Index i = 0; i < x.size(); ++i) damped(i, i) += damping * a(i, i) + 1e-9;
        VectorXd to = x + damped.ldlt().solve(b);
        keep_in_range(to);
        const double then = error(to);
        better = then < now;
        if (better) {
          x = to, now = then;
          damping = std::max(damping / 4, 1e-7);
        } else {
          damping = std::min(damping * 5, 1e3);
        }
      }
    }
    return x;
  }

  const Curves& curves_;
  const Fixed& fixed_;
  const Pairs& pairs_;
  Powers p_;
  Index own_;  ///< unknowns of each channel
  std::vector<std::vector<Index>> used_;
  double mean_ = 0;
  VectorXd x_;
  double error_ = 0;
};

}  // namespace

std::optional<CurveRoles> curve_roles(const Model& model) {
  if (model.info().name != "factors") return std::nullopt;
  CurveRoles out;
  for (const ParamInfo& p : model.info().params) {
    if (p.name == "rho")
      out.matte = &p;
    else if (p.name == "rim")
      out.rim = &p;
    else if (p.name == "strength")
      out.strength = &p;
    else if (p.name == "widening" || p.name == "heights")
      out.shape.push_back(&p);
    else if (p.name == "ax" || p.name == "ay")
      out.roughness.push_back(&p);
    else
      (p.kind == ParamKind::Color ? out.colors : out.numbers).push_back(&p);
  }
  return out;
}

ModelFit fit_factors(const Model& model, const CurveRoles& roles, bool isotropic, const Pairs& coarse,
                     const Pairs& fine, const Pairs& last) {
  const auto start = std::chrono::steady_clock::now();
  const Curves curves(model, roles);
  ModelFit out;
  out.model = &model;
  out.found = int(roles.colors.size() + roles.numbers.size()) + 5 + (isotropic ? 1 : 2);
  if (!(fine.light > 0 && last.light > 0)) {
    out.values = curves.matte_alone(last);
    return out;
  }
  // Places: the shape, then the roughnesses.
  const std::size_t shapes = roles.shape.size();
  const auto place_of = [&](const std::array<double, 2>& shape) {
    std::vector<double> t;
    for (std::size_t i = 0; i < shapes; ++i)
      t.push_back((shape[i] - roles.shape[i]->min) / (roles.shape[i]->max - roles.shape[i]->min));
    return t;
  };
  const auto lobe = [&](const std::vector<double>& t) {
    CurveLobe out;
    for (std::size_t i = 0; i < shapes; ++i)
      out.shape.push_back(roles.shape[i]->min + (roles.shape[i]->max - roles.shape[i]->min) * t[i]);
    for (std::size_t i = 0; i < roles.roughness.size(); ++i)
      out.roughness.push_back(kSmoothest * std::pow(kRoughest / kSmoothest, t[isotropic ? shapes : shapes + i]));
    return out;
  };
  struct Try {
    std::vector<double> t;
    double error = 0;
  };
  const Fixed of_coarse = curves.fixed(coarse), of_fine = curves.fixed(fine);
  const auto error = [&](const std::vector<double>& t, const Fixed& fixed, const Pairs& pairs) {
    Heights heights(curves, lobe(t), fixed, pairs);
    heights.solve(kFewSteps);
    return heights.error();
  };
  std::vector<Try> tries;
  for (const std::array<double, 2>& shape : kShapes) {
    const auto try_with = [&](std::initializer_list<double> roughness) {
      std::vector<double> t = place_of(shape);
      t.insert(t.end(), roughness);
      tries.push_back({t});
    };
    const bool first = shape == kShapes[0];
    const int places = first ? kPlaces : kPlacesOfOthers;
    if (isotropic)
      for (int i = 0; i < places; ++i) try_with({i / (places - 1.)});
    else
      for (int i = 0; i < kPlacesEach; ++i)
        for (int j = 0; j < kPlacesEach; ++j)
          if (first || (i + j) % 2 == 0) try_with({i / (kPlacesEach - 1.), j / (kPlacesEach - 1.)});
  }
  for (Try& t : tries) t.error = error(t.t, of_coarse, coarse);
  std::ranges::stable_sort(tries, {}, &Try::error);
  tries.resize(kStarts);
  for (Try& t : tries) {
    std::vector<fit::Variable> variables;
    for (const double x : t.t) variables.push_back({x, 0, 1, isotropic ? 0.03 : 0.08});
    t.t = fit::argmin(variables,
                      [&](const std::vector<double>& x) { return std::min(error(x, of_coarse, coarse), 1e6); });
    t.error = error(t.t, of_fine, fine);
  }
  std::vector<double> best = std::ranges::min_element(tries, {}, &Try::error)->t;
  auto heights = std::make_unique<Heights>(curves, lobe(best), of_fine, fine);
  heights->solve(kSteps);
  // A shape that has a name is better than one beside it.
  const std::vector<double> shape = lobe(best).shape;
  for (const std::array<double, 2>& named : kShapes) {
    if (std::hypot(shape[0] - named[0], shape[1] - named[1]) > kBesideShape) continue;
    std::vector<double> to = best;
    std::ranges::copy(place_of(named), to.begin());
    auto with_name = std::make_unique<Heights>(curves, lobe(to), of_fine, fine);
    with_name->solve(kSteps);
    if (with_name->error() < kAsGood * heights->error()) best = to, heights = std::move(with_name);
  }
  const auto found = [&](const ParamValues& values) {
    const auto brdf = model.make_double(values);
    Colors f(last.wi.size());
    for (std::size_t k = 0; k < f.size(); ++k) f[k] = brdf->eval(last.wi[k], last.wo[k]);
    return error_of(last, f);
  };
  out.values = curves.values(lobe(best), heights->logs(), heights->matte(), heights->rim());
  out.error = found(out.values);
  // A peak between the directions of a table may be met by none of the pairs that the curves were found with.
  const ParamValues matte = curves.matte_alone(last);
  if (const double error = found(matte); !(out.error < error)) out.values = matte, out.error = error;
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace brdfc::measured
