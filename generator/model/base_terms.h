// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that bases consist of; their normal is the surface's. The constants in their weights and roughnesses
// were chosen, over the view and the sliders' ranges, to make the part of the model that a base lacks small: its
// magnitude, because Cycles selects a closure with a probability proportional to that, and its square. base_worth()
// measures both.
#pragma once

#include <array>
#include <cmath>

#include "closures/closure.h"

namespace brdfc::inline model {

/// The smallest roughness that Cycles uses; smoother facets get this one.
inline constexpr double kLeastRoughness = 1e-4;

template <class T> T facet_alpha(const T& alpha) { return minimum(maximum(alpha, T(kLeastRoughness)), T(1)); }

/// Facets with one roughness.
template <class T> Closure<T> facets(ClosureKind kind, const Rgb<T>& weight, const T& alpha) {
  Closure<T> c(kind, weight);
  c.alpha = facet_alpha(alpha);
  return c;
}

/// Facets with two roughnesses: along the tangent, rotated by `rotation`, and across it.
template <class T>
Closure<T> facets(ClosureKind kind, const Rgb<T>& weight, const T& alpha_x, const T& alpha_y, const T& rotation) {
  Closure<T> c(kind, weight);
  c.alpha = facet_alpha(alpha_x);
  c.alpha_across = facet_alpha(alpha_y);
  c.tangent = {cos(rotation), sin(rotation), T(0)};
  c.stretched = Tangent::Surface;
  return c;
}

/// Rough matte facets without interreflection: f = weight / pi (1 + ratio t), where t = (wi.wo - wi.z wo.z), for light
/// on the viewer's side divided by the larger cosine. The closure represents them as facets with a small albedo,
/// between which almost nothing is reflected again: 1e-5 of the light at most.
template <class T> Closure<T> rough_facets(const Rgb<T>& weight, const T& ratio) {
  constexpr double kAlbedo = 1e-2;
  Closure<T> c(ClosureKind::OrenNayar, weight * ((T(1) + ratio * T(0.5 - 2 * kInvPi / 3)) / T(kAlbedo)));
  c.roughness = ratio;
  c.albedo = Rgb<T>(T(kAlbedo));
  return c;
}

/// Rough matte facets of the albedo `rho` with all interreflection: J. Portsmouth, P. Kutz, S. Hill: EON: A Practical
/// Energy-Preserving Rough Diffuse BRDF, JCGT 2025, with the exact albedo. With a mean loss L it is
/// rho once + rho^2 (1 - L) / (1 - rho L) again. Cycles' closure multiplies both by its albedo, once more than that.
/// So with the albedo a and the weight rho / a it is the same, if a^2 / (1 - a L) = rho / (1 - rho L).
template <class T> Closure<T> lossless_rough_facets(const Rgb<T>& rho, const T& roughness) {
  const T lost = roughness * T(kInvPi * kMeanMatteLoss) / (T(1) + roughness * T(0.5 - 2 * kInvPi / 3));
  Closure<T> c(ClosureKind::OrenNayar, Rgb<T>(T(0)));
  c.roughness = roughness;
  const Rgb<T> half = rho * (lost / T(2)), kept = Rgb<T>(T(1)) - rho * lost;
  const Rgb<T> root = sqrt(half * half + rho * kept);
  c.weight = root + half;
  c.albedo = (root - half) / kept;
  return c;
}

/// cos^e alpha about the mirror direction, without colours of its own.
template <class T> Closure<T> power_closure(const Rgb<T>& weight, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, weight);
  c.ramp.fill(Rgb<T>(T(1)));
  c.exponent = exponent;
  return c;
}

/// The share of a narrow lobe in a base. Sampling the BSDF meets the sky well enough if the sky is nearly constant over
/// the lobe. The share is 1 up to an exponent of 200 and 0 from 300 on.
template <class T> T share_of_wide(const T& e) { return clamp01(T(3) - e / T(100)); }

/// An approximation of cos^e alpha about the mirror direction by cones, for e >= 1: piecewise linear in the angle, with
/// an error of 1.8 % of its light. No other closure lacks the cosine.
template <class T> ClosureSum<T> power_cones(const Rgb<T>& weight, const T& e) {
  // The values of the power at these places, and of the sum of cones: the smallest L1 error for a narrow lobe.
  constexpr std::array<double, 6> kPowers = {1, 0.84067, 0.32596, 0.12954, 0.03489, 0.00358};
  constexpr std::array<double, 6> kHeights = {1.0645, 0.848, 0.3147, 0.1186, 0.0274, 0};
  ClosureSum<T> sum;
  T inner(0);
  for (std::size_t i = 1; i < kPowers.size(); ++i) {
    // 1 - cos alpha without cancellation; and alpha in units of 90 degrees.
    const T q = -expm1(T(std::log(kPowers[i])) / maximum(e, T(0.01)));
    const T outer = T(4 * kInvPi) * atan(sqrt(q / (T(2) - q)));
    Closure<T>& c =
        sum.emplace_back(ClosureKind::GlossyToon, weight * (T(2 * kPi * (kHeights[i - 1] - kHeights[i])) * q));
    c.size = inner, c.smooth = outer - inner;
    inner = outer;
  }
  return sum;
}

/// The mean height of a lobe whose axis is at height z: near the surface the lower half of the lobe is cut off. To be
/// used where a weight is divided by a height, or for the Fresnel term of one.
template <class T> T lobe_height(const T& z, const T& variance) { return sqrt(z * z + variance); }

}  // namespace brdfc::inline model
