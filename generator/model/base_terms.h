// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that bases are made of, about the surface's normal. Their weights and roughnesses have constants that
// make little of what a base lacks: of its magnitude, because Cycles follows what is drawn as often as that is large,
// and of its square, over the view and the sliders' ranges. base_worth() measures both.
#pragma once

#include <array>
#include <cmath>

#include "closures/closure.h"

namespace brdfc::inline model {

/// The least roughness that Cycles takes; below it facets are this rough.
inline constexpr double kLeastRoughness = 1e-4;

template <class T> T facet_alpha(const T& alpha) { return minimum(maximum(alpha, T(kLeastRoughness)), T(1)); }

/// Facets of one roughness.
template <class T> Closure<T> facets(ClosureKind kind, const Rgb<T>& weight, const T& alpha) {
  Closure<T> c(kind, weight);
  c.alpha = facet_alpha(alpha);
  return c;
}

/// Facets of two, along the tangent turned by `rotation` and across it.
template <class T>
Closure<T> facets(ClosureKind kind, const Rgb<T>& weight, const T& alpha_x, const T& alpha_y, const T& rotation) {
  Closure<T> c(kind, weight);
  c.alpha = facet_alpha(alpha_x);
  c.alpha_across = facet_alpha(alpha_y);
  c.tangent = {cos(rotation), sin(rotation), T(0)};
  c.stretched = Tangent::Surface;
  return c;
}

/// Rough matte facets that reflect light once: f = weight / pi (1 + ratio t), where t = (wi.wo - wi.z wo.z), towards
/// the viewer over the larger cosine. The closure has these as facets of little albedo, between which next to nothing
/// is reflected again: 1e-5 of it at most.
template <class T> Closure<T> rough_facets(const Rgb<T>& weight, const T& ratio) {
  constexpr double kAlbedo = 1e-2;
  Closure<T> c(ClosureKind::OrenNayar, weight * ((T(1) + ratio * T(0.5 - 2 * kInvPi / 3)) / T(kAlbedo)));
  c.roughness = ratio;
  c.albedo = Rgb<T>(T(kAlbedo));
  return c;
}

/// Rough matte facets of the albedo `rho` between which light goes on until it leaves: J. Portsmouth, P. Kutz, S. Hill:
/// EON: A Practical Energy-Preserving Rough Diffuse BRDF, JCGT 2025, with the albedo that is exact. Cycles' closure
/// multiplies what facets reflect again by their colour once more than that. Of white ones it is right, and the rest is
/// what is reflected once.
template <class T> ClosureSum<T> lossless_rough_facets(const Rgb<T>& rho, const T& roughness) {
  const T scale = T(1) + roughness * T(0.5 - 2 * kInvPi / 3);
  const T lost = roughness * T(kInvPi * kMeanMatteLoss) / scale;
  Closure<T> white(ClosureKind::OrenNayar, rho * rho * (T(1) - lost) / (Rgb<T>(T(1)) - rho * lost));
  white.roughness = roughness;
  white.albedo = Rgb<T>(T(1));
  return {white, rough_facets((rho - white.weight) / scale, roughness)};
}

/// cos^e alpha about the mirror direction, without colours of its own.
template <class T> Closure<T> power_closure(const Rgb<T>& weight, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, weight);
  c.ramp.fill(Rgb<T>(T(1)));
  c.exponent = exponent;
  return c;
}

/// What narrow lobes count of a base: drawn directions meet the sky well where it is as good as even over the lobe.
/// Full to an exponent of 200, none from 300 on.
template <class T> T share_of_wide(const T& e) { return clamp01(T(3) - e / T(100)); }

/// cos^e alpha about the mirror direction but for 1.8 % of its light, for e from 1 on: cones, which make it linear in
/// the angle between places. No other closure lacks the cosine.
template <class T> ClosureSum<T> power_cones(const Rgb<T>& weight, const T& e) {
  // The power at these places, and the sum: the least L1 for a narrow lobe.
  constexpr std::array<double, 6> kPowers = {1, 0.84067, 0.32596, 0.12954, 0.03489, 0.00358};
  constexpr std::array<double, 6> kHeights = {1.0645, 0.848, 0.3147, 0.1186, 0.0274, 0};
  ClosureSum<T> sum;
  T inner(0);
  for (std::size_t i = 1; i < kPowers.size(); ++i) {
    // 1 - cos alpha, with all its digits; and alpha in units of 90 degrees.
    const T q = -expm1(T(std::log(kPowers[i])) / maximum(e, T(0.01)));
    const T outer = T(4 * kInvPi) * atan(sqrt(q / (T(2) - q)));
    Closure<T>& c =
        sum.emplace_back(ClosureKind::GlossyToon, weight * (T(2 * kPi * (kHeights[i - 1] - kHeights[i])) * q));
    c.size = inner, c.smooth = outer - inner;
    inner = outer;
  }
  return sum;
}

/// How high a lobe is on average, whose axis is at height z: of one near the surface the lower half is cut off. A
/// weight that is divided by a height, or a Fresnel term of one, takes this.
template <class T> T lobe_height(const T& z, const T& variance) { return sqrt(z * z + variance); }

}  // namespace brdfc::inline model
