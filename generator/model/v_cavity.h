// SPDX-License-Identifier: GPL-3.0-or-later
// Microfacets that form symmetric V-shaped cavities: Torrance and Sparrow's geometry term, which Blinn and also Cook
// and Torrance use. It applies to any distribution D of microfacet normals with D(h) = D(h'), where h' is h rotated by
// 180 degrees about n.
//
// K. Torrance, E. Sparrow: Theory for Off-Specular Reflection from Roughened Surfaces, JOSA 57(9), 1967. G = min(1, 2
// (n.h)(n.i) / (o.h), 2 (n.h)(n.o) / (o.h)), f = F D G / (4 (n.i)(n.o)), where D (n.h) integrates to 1. The visible
// microfacets, max(o.h, 0) D G_1 / (n.o) with G_1 = min(1, 2 (n.h)(n.o) / (o.h)), integrate to 1 (E. Heitz:
// Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, JCGT 3(2), 2014), and G <= G_1, so f never
// gains energy. Microfacets are sampled from D (n.h); then sample weights are below 2 F.
#pragma once

#include "model/half_vector.h"

namespace brdfc::inline model {

/// G / ((n.i)(n.o)), written so that grazing directions neither overflow nor give 0 / 0.
template <class T> T v_cavity_shape(const HalfVector<T>& k, const Vec3<T>& wi, const Vec3<T>& wo) {
  const T larger = maximum(maximum(wi.z, wo.z), tiny<T>());
  return minimum(T(1) / maximum(wi.z * wo.z, tiny<T>()), T(2) * k.h.z / (k.oh * larger));
}

/// The pdf of wi if microfacets are sampled from D (n.h).
template <class T> T v_cavity_pdf(const HalfVector<T>& k, const T& D) { return D * k.h.z / (T(4) * k.oh); }

/// The factor of f cos(theta_i) / pdf beside F: G (o.h) / ((n.o) (n.h)).
template <class T> T v_cavity_weight(const Vec3<T>& h, const T& oh, const Vec3<T>& wi, const Vec3<T>& wo) {
  const T zo = maximum(wo.z, tiny<T>());
  return minimum(oh / maximum(zo * h.z, tiny<T>()), T(2) * minimum(wi.z / zo, T(1)));
}

}  // namespace brdfc::inline model
