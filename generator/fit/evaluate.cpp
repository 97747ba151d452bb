// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/evaluate.h"

#include <algorithm>
#include <cmath>

#include "fit/view_axis.h"

namespace brdfc::fit {
namespace {

/// Coordinates for all tables that run over the view.
template <class T> std::vector<T> place(const FitTables& t, const Vec3<T>& wo, const T& number) {
  std::vector<T> at;
  if (t.axis) at.push_back(named("place_on_axis", lookup(t.position, std::vector<T>{t.axis->place(number)})));
  at.push_back(named("place", view_place(wo, t.first_view, t.view_length)));
  return at;
}

/// Closure j without weight and colours. `side` is mirror_side().
template <class T> Closure<T> shape(const FitTables& t, std::size_t j, const Vec3<T>& side, const std::vector<T>& at) {
  if (j < t.lobes.size()) {
    const T offset = lookup(t.lobes[j].offset, at), power = lookup(t.lobes[j].exponent, at);
    if (!t.axis) return lobe_closure(side, offset, power);
    return lobe_closure(side, offset * exp(power / T(-2)), exp(power));
  }
  if (j == t.lobes.size()) return Closure<T>(ClosureKind::DiffuseRamp, Rgb<T>(T(1)));
  const FitTables::FacetTables& facets = t.facets[j - t.lobes.size() - 1];
  return facet_closure(facets.kind, side, lookup(facets.offset, at), exp(lookup(facets.log_alpha, at)),
                       exp(lookup(facets.log_stretch, at)));
}

template <class T> Rgb<T> tint_of(const FitTables& t) { return {T(t.tint.r), T(t.tint.g), T(t.tint.b)}; }

template <class T> T amplitude_of(const FitTables& t, std::size_t term, const std::vector<T>& at) {
  return t.axis ? named("amplitude", T(t.scale) * exp(lookup(t.amplitude[term], at))) : T(1);
}

/// The weight of each term, in the closures' units and with their tint. Empty without mixed parameters: then the tables
/// contain everything except the amplitude.
template <class T>
std::vector<Rgb<T>> counts_of(const FitTables& t, const std::vector<T>& at, const std::vector<Rgb<T>>& weights) {
  std::vector<Rgb<T>> out;
  for (std::size_t k = 0; k < t.terms.terms.size() && !t.terms.parameters.empty(); ++k) {
    const Rgb<T> coloured = tint_of<T>(t) * weights[k];
    out.push_back(named("count_of_term", t.axis ? coloured * amplitude_of(t, k, at) : coloured));
  }
  return out;
}

template <class T> std::vector<Rgb<T>> weights_of(const FitTables& t, const Varied<T>& varied) {
  if (t.terms.parameters.empty()) return {Rgb<T>(T(1))};
  return t.terms.weights(varied.parameters);
}

/// Colour of closure j. If `counts` is empty, tint and amplitude are not included. `at` has the coordinates of its
/// tables.
template <class T>
Rgb<T> colour(const FitTables& t, std::size_t j, const std::vector<T>& at, const std::vector<Rgb<T>>& counts) {
  const auto term = [&](std::size_t k) {
    const auto& channels = t.linear[j].colour[k];
    if (channels.size() == 1) return Rgb<T>(lookup(channels[0], at));
    return Rgb<T>(lookup(channels[0], at), lookup(channels[1], at), lookup(channels[2], at));
  };
  if (counts.empty()) return term(0);
  Rgb<T> sum = counts[0] * term(0);
  for (std::size_t k = 1; k < counts.size(); ++k) sum += counts[k] * term(k);
  return sum;
}

/// Coordinates for a ramp's table.
template <class T> std::vector<T> on_ramp(std::vector<T> at, const T& position) {
  at.push_back(position);
  return at;
}

/// The same as closures(), for given weights of the terms.
template <class T> ClosureSum<T> weighted(const FitTables& t, const Vec3<T>& wo, const T& number,
                                          const std::vector<Rgb<T>>& weights, const T& share, bool divided) {
  const std::vector<T> at = place(t, wo, number);
  const std::vector<Rgb<T>> counts = counts_of(t, at, weights);
  // With terms, `counts` contains both.
  const T amplitude = counts.empty() ? amplitude_of(t, 0, at) : T(1);
  const Rgb<T> tint = counts.empty() ? tint_of<T>(t) : Rgb<T>(T(1));
  const Vec3<T> side = mirror_side(wo);
  ClosureSum<T> sum;
  for (std::size_t j = 0; j < t.linear.size(); ++j) {
    Closure<T>& c = sum.emplace_back(shape(t, j, side, at));
    if (!has_ramp(c.kind)) {
      c.weight = tint * amplitude * colour(t, j, at, counts);
      continue;
    }
    const auto on = [&](std::size_t k) { return on_ramp(at, T(double(k) / (kRampSize - 1))); };
    const auto share_of = [&](std::size_t term) { return maximum(lookup(t.linear[j].weight[term], at), T(1e-20)); };
    if (counts.empty()) {
      const T weight = share_of(0) * amplitude * share;
      c.weight = tint * weight;
      for (std::size_t k = 0; k < kRampSize; ++k)
        c.ramp[k] = colour(t, j, on(k), counts) * (divided ? amplitude / weight : amplitude);
      continue;
    }
    Rgb<T> weight(T(0));
    for (std::size_t term = 0; term < counts.size(); ++term) weight += counts[term] * share_of(term);
    // The small constant is for colours that may be black.
    c.weight = weight * share + Rgb<T>(T(1e-20));
    for (std::size_t k = 0; k < kRampSize; ++k) {
      c.ramp[k] = colour(t, j, on(k), counts);
      if (divided) c.ramp[k] = c.ramp[k] / c.weight;
    }
  }
  return sum;
}

/// The local frame about a normal that is turned towards a viewer below kLowestView until the view is as high as that.
class TurnedFrame {
 public:
  explicit TurnedFrame(const Vec3<double>& wo) : side_(mirror_side(wo)) {
    const double angle = std::asin(kLowestView) - std::asin(wo.z);
    cos_ = std::cos(angle), sin_ = std::sin(angle);
  }
  Vec3<double> into(const Vec3<double>& v) const { return turned(v, sin_); }
  Vec3<double> out_of(const Vec3<double>& v) const { return turned(v, -sin_); }

 private:
  Vec3<double> turned(const Vec3<double>& v, double sin) const {
    const double along = dot(side_, v);
    Vec3<double> out = v + side_ * (along * (cos_ - 1) + v.z * sin);
    out.z = v.z * cos_ - along * sin;
    return out;
  }
  Vec3<double> side_;
  double cos_, sin_;
};

}  // namespace

Varied<double> varied_of(const std::optional<FitAxis>& axis, const Terms& terms, const ParamValues& values) {
  Varied<double> out;
  if (axis) out.number = std::get<double>(values.at(axis->parameter));
  for (const std::string& name : terms.parameters) out.parameters[name] = as_rgb(values.at(name));
  return out;
}

template <class T>
ClosureSum<T> closures(const FitTables& t, const Vec3<T>& wo, const Varied<T>& varied, const T& share, bool divided) {
  if constexpr (std::is_same_v<T, double>)
    if (wo.z < kLowestView) {
      const TurnedFrame frame(wo);
      ClosureSum<T> sum = weighted(t, frame.into(wo), varied.number, weights_of(t, varied), share, divided);
      for (Closure<T>& c : sum) {
        c.normal = frame.out_of(c.normal);
        c.tangent = frame.out_of(c.tangent);
        c.turned = true;
      }
      return sum;
    }
  return weighted(t, wo, varied.number, weights_of(t, varied), share, divided);
}
template ClosureSum<double> closures(const FitTables&, const Vec3<double>&, const Varied<double>&, const double&, bool);
template ClosureSum<Expr> closures(const FitTables&, const Vec3<Expr>&, const Varied<Expr>&, const Expr&, bool);

template <class T> Rgb<T> f_cos(const FitTables& t, const Vec3<T>& wi, const Vec3<T>& wo, const Varied<T>& varied) {
  if constexpr (std::is_same_v<T, double>)
    if (wo.z < kLowestView) {
      const TurnedFrame frame(wo);
      const Vec3<T> turned = frame.into(wo);
      // The height is clamped; otherwise rounding could make this recursion endless.
      return f_cos(t, frame.into(wi), {turned.x, turned.y, std::max(turned.z, kLowestView)}, varied);
    }
  const std::vector<T> at = place(t, wo, varied.number);
  const std::vector<Rgb<T>> counts = counts_of(t, at, weights_of(t, varied));
  // In the coordinates of the plane of incidence, where normals have only two components that are not 0.
  const Vec3<T> side = mirror_side(wo), x = {T(1), T(0), T(0)}, o = {-sqrt(sin2_theta(wo)), T(0), wo.z},
                i = {dot(side, wi), side.x * wi.y - side.y * wi.x, wi.z};
  Rgb<T> sum(T(0));
  for (std::size_t j = 0; j < t.linear.size(); ++j) {
    Closure<T> c = shape(t, j, x, at);
    if (!has_ramp(c.kind)) c.weight = colour(t, j, at, counts);
    sum += evaluate(c, i, o, [&](const T& position) { return colour(t, j, on_ramp(at, position), counts); });
  }
  return counts.empty() ? tint_of<T>(t) * amplitude_of(t, 0, at) * sum : sum;
}
template Rgb<double> f_cos(const FitTables&, const Vec3<double>&, const Vec3<double>&, const Varied<double>&);
template Rgb<Expr> f_cos(const FitTables&, const Vec3<Expr>&, const Vec3<Expr>&, const Varied<Expr>&);

ClosureSum<double> closures_by_weights(const FitTables& t, const Vec3<double>& wo, double number,
                                       const std::vector<Rgb<double>>& weights) {
  return weighted(t, wo, number, weights, 1.0, true);
}

}  // namespace brdfc::fit
