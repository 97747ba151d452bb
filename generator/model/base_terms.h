// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that bases are made of, about the surface's normal. Their weights and roughnesses have constants that
// make little of what a base lacks: of its magnitude, because Cycles follows what is drawn as often as that is large,
// and of its square, over the view and the sliders' ranges. base_worth() measures both.
#pragma once

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

/// cos^e alpha about the mirror direction, without colours of its own.
template <class T> Closure<T> power_closure(const Rgb<T>& weight, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, weight);
  c.ramp.fill(Rgb<T>(T(1)));
  c.exponent = exponent;
  return c;
}

/// How high a lobe is on average, whose axis is at height z: of one near the surface the lower half is cut off. A
/// weight that is divided by a height, or a Fresnel term of one, takes this.
template <class T> T lobe_height(const T& z, const T& variance) { return sqrt(z * z + variance); }

}  // namespace brdfc::inline model
