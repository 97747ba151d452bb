// SPDX-License-Identifier: GPL-3.0-or-later
// The closures whose sum is a fit: phong_ramps about axes in the plane of incidence, a diffuse_ramp, and facets that
// lean and are stretched in that plane. This file places and evaluates them.
#pragma once

#include <Eigen/Dense>
#include <vector>

#include "closures/closure.h"
#include "fit/view.h"

namespace brdfc::fit {

/// A phong_ramp: cos^exponent about an axis `offset` radians from the mirror direction towards the normal.
struct RampLobe {
  double offset, exponent;
};

/// A microfacet closure about a normal that leans by half of `offset` radians, so that the lobe about its mirror
/// direction leans as a RampLobe with this offset. Its roughness alpha is alpha * stretch in the plane of incidence and
/// alpha / stretch across it.
struct Facet {
  ClosureKind kind;  ///< Beckmann or Ggx
  double offset, alpha, stretch;
};

/// Sets of closures. A fit uses one family for all views.
enum class Family {
  Moving,     ///< seven phong_ramps about the axis of the model's lobe
  Fixed,      ///< seven about the mirror direction, with widths that do not depend on the view
  Microfacet  ///< five from the axis of the lobe towards the normal, and facets that lean away from the viewer
};
inline constexpr Family kFamilies[] = {Family::Moving, Family::Fixed, Family::Microfacet};

/// The phong_ramps of a family for a view `height` radians above the surface. `here` is the model's lobe at this view,
/// `at_normal` that at normal incidence.
std::vector<RampLobe> place_lobes(Family, const Moments& here, const Moments& at_normal, double height);

/// The normal, rotated away from mirror_side() by half of `offset`: the lobe about its mirror direction then has its
/// axis at beside_mirror(wo, offset).
template <class T> Vec3<T> leaning(const Vec3<T>& side, const T& offset) {
  const T half = offset / T(2);
  Vec3<T> n = side * -sin(half);
  n.z = cos(half);
  return n;
}

/// The closure for a RampLobe, with a black ramp. `side` is mirror_side() of the view.
template <class T> Closure<T> lobe_closure(const Vec3<T>& side, const T& offset, const T& exponent) {
  Closure<T> c(ClosureKind::PhongRamp, Rgb<T>(T(1)));
  c.normal = leaning(side, offset);
  c.turned = true;
  c.exponent = exponent;
  return c;
}

/// The closure for a Facet, with a weight of 1. `side` is mirror_side() of the view.
template <class T>
Closure<T> facet_closure(ClosureKind kind, const Vec3<T>& side, const T& offset, const T& alpha, const T& stretch) {
  Closure<T> c(kind, Rgb<T>(T(1)));
  c.normal = leaning(side, offset);
  c.turned = true;
  c.alpha = alpha * stretch;
  c.alpha_across = alpha / stretch;
  c.tangent = cross(Vec3<T>{-side.y, side.x, T(0)}, c.normal);
  c.stretched = Tangent::View;
  return c;
}

/// The values of f cos(theta_i) of a view's closures at `points`, one row per point. The columns are the kRampSize
/// colours of each lobe's ramp, each with that colour white and the others black; then those of the diffuse_ramp; then
/// one for each facet.
Eigen::MatrixXd dictionary(const std::vector<RampLobe>& lobes, const std::vector<Facet>& facets, const Points& points,
                           const Vec3<double>& wo);

}  // namespace brdfc::fit
