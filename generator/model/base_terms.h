// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that bases are made of, about the surface's normal.
#pragma once

#include "represent/closure.h"

namespace brdfc {

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

/// The height above the surface that a lobe of this exponent has on average, whose axis is at height z.
template <class T> T lobe_height(const T& z, const T& e) { return sqrt(z * z + T(0.5) / (e + T(2))); }

}  // namespace brdfc
