// SPDX-License-Identifier: GPL-3.0-or-later
// Microfacets with the distribution ggx of two roughnesses, also named after Trowbridge and Reitz or GTR2: E. Heitz:
// Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, JCGT 3(2), 2014.
#pragma once

#include "model/half_vector.h"

namespace brdfc::inline model {

template <class T> struct GgxFacets {
  T ax, ay;

  T D(const Vec3<T>& h) const {
    return named("D", T(1) / (pi<T>() * ax * ay * sqr(sqr(h.x / ax) + sqr(h.y / ay) + sqr(h.z))));
  }

  /// (n.w) Lambda of Smith's masking, for w above the surface.
  T hidden(const Vec3<T>& w) const {
    const T c = maximum(w.z, tiny<T>()), p2 = named("p2", sqr(ax * w.x) + sqr(ay * w.y));
    return p2 / (T(2) * (sqrt(c * c + p2) + c));
  }

  /// A normal that is visible from w: J. Dupuy, A. Benyoub: Sampling Visible GGX Normals with Spherical Caps, HPG 2023.
  Vec3<T> sample_normal(const Vec3<T>& w, const T& u1, const T& u2) const {
    const Vec3<T> k = normalize(Vec3<T>{ax * w.x, ay * w.y, w.z});
    // A direction of the cap of cosines above -k.z: 1 - cosine, without cancellation.
    const T drop = u1 * (T(1) + k.z), sine = sqrt(maximum(drop * (T(2) - drop), T(0)));
    const T phi = named("phi", T(2) * pi<T>() * u2);
    return normalize(Vec3<T>{ax * (k.x + sine * cos(phi)), ay * (k.y + sine * sin(phi)), (T(1) - u1) * (T(1) + k.z)});
  }
};

}  // namespace brdfc::inline model
