// SPDX-License-Identifier: GPL-3.0-or-later
// Microfacets that form symmetric V-shaped cavities: Torrance and Sparrow's geometry term, which Blinn and also Cook
// and Torrance use. It applies to any distribution D of microfacet normals with D(h) = D(h'), where h' is h rotated by
// 180 degrees about n.
//
// K. Torrance, E. Sparrow: Theory for Off-Specular Reflection from Roughened Surfaces, JOSA 57(9), 1967. G = min(1, 2
// (n.h)(n.i) / (o.h), 2 (n.h)(n.o) / (o.h)), f = F D G / (4 (n.i)(n.o)), where D (n.h) integrates to 1. The visible
// microfacets, max(o.h, 0) D G_1 / (n.o) with G_1 = min(1, 2 (n.h)(n.o) / (o.h)), integrate to 1 (E. Heitz:
// Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, JCGT 3(2), 2014), and G <= G_1, so f never
// gains energy. Models sample microfacets from D (n.h); then sample weights are below 2 F. Beside a base, nodes sample
// the visible ones as in E. Heitz, E. d'Eon: Importance Sampling Microfacet-Based BSDFs using the Distribution of
// Visible Normals, EGSR 2014: a microfacet of D (n.h), or the other side of its cavity. Then weights are below F.
#pragma once

#include "model/half_vector.h"

namespace brdfc::inline model {

/// G / ((n.i)(n.o)), written so that grazing directions neither overflow nor give 0 / 0.
template <class T> T v_cavity_shape(const HalfVector<T>& k, const Vec3<T>& wi, const Vec3<T>& wo) {
  const T larger = maximum(maximum(wi.z, wo.z), tiny<T>());
  return minimum(T(1) / maximum(wi.z * wo.z, tiny<T>()), T(2) * k.h.z / (k.oh * larger));
}

/// Of the two sides of a cavity, one of which has the normal h, the one that is seen: each with a probability that is
/// proportional to its visible area. `u` is a random number.
template <class T> Vec3<T> visible_side(const Vec3<T>& h, const Vec3<T>& wo, const T& u) {
  const T across = h.x * wo.x + h.y * wo.y, up = h.z * wo.z;
  const T here = maximum(up + across, T(0)), there = maximum(up - across, T(0));
  const T side = select(u * (here + there) < here, T(1), T(-1));
  return {h.x * side, h.y * side, h.z};
}

/// The pdf of wi if visible microfacets are sampled: D G_1 / (4 (n.o)).
template <class T> T visible_side_pdf(const HalfVector<T>& k, const T& D, const Vec3<T>& wo) {
  return D * minimum(T(1) / (T(4) * maximum(wo.z, tiny<T>())), k.h.z / (T(2) * k.oh));
}

/// The factor of f cos(theta_i) / visible_side_pdf() beside F: G / G_1.
template <class T> T visible_side_weight(const Vec3<T>& h, const T& oh, const Vec3<T>& wi, const Vec3<T>& wo) {
  return minimum(T(1), wi.z * maximum(T(1) / maximum(wo.z, tiny<T>()), T(2) * h.z / maximum(oh, tiny<T>())));
}

/// The pdf of wi if microfacets are sampled from D (n.h).
template <class T> T v_cavity_pdf(const HalfVector<T>& k, const T& D) { return D * k.h.z / (T(4) * k.oh); }

/// The factor of f cos(theta_i) / pdf beside F: G (o.h) / ((n.o) (n.h)).
template <class T> T v_cavity_weight(const Vec3<T>& h, const T& oh, const Vec3<T>& wi, const Vec3<T>& wo) {
  const T zo = maximum(wo.z, tiny<T>());
  return minimum(oh / maximum(zo * h.z, tiny<T>()), T(2) * minimum(wi.z / zo, T(1)));
}

}  // namespace brdfc::inline model
