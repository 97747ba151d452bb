// SPDX-License-Identifier: GPL-3.0-or-later
// Rough surfaces made of microfacets: the distributions of their normals, the part that other facets hide, and sampling
// of the facets that are seen. What facets do with light is left to the model.
//
// B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007, with
// two roughnesses as in E. Heitz: Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs, JCGT 3(2),
// 2014. With the slopes x, y of the normal and s2 = (x / ax)^2 + (y / ay)^2,
//   ggx:       D = 1 / (pi ax ay (n.h)^4 (1 + s2)^2), also named after Trowbridge and Reitz, 1975,
//   beckmann:  D = exp(-s2) / (pi ax ay (n.h)^4);
//   smith_correlated: G = 1 / (1 + Lambda_i + Lambda_o), Heitz eq. 99,
//   smith_separable:  G = 1 / ((1 + Lambda_i) (1 + Lambda_o)).
// With a = (n.w) / sqrt((ax w.x)^2 + (ay w.y)^2), Lambda is (sqrt(1 + 1 / a^2) - 1) / 2 for ggx. For beckmann it is
// Walter's rational approximation of its sec. 5.2, off by less than 0.35 % of G, which Cycles uses as well.
//
// Numerical stability. (n.w) Lambda is finite at the horizon, Lambda is not: the quotient G / (4 (n.i)(n.o)) is
// computed from the former.
//
// Sampling. Visible normals of Smith's ggx by spherical caps: J. Dupuy, A. Benyoub: Sampling Visible GGX Normals with
// Spherical Caps, HPG 2023. Visible normals of V-cavities, which need nothing but D (n.h): a normal is drawn, and
// itself or its opposite is taken, with probabilities as their projected areas (Heitz 2014, sec. 5.2; E. Heitz, E.
// d'Eon: Importance Sampling Microfacet-Based BSDFs using the Distribution of Visible Normals, EGSR 2014). Smith's
// beckmann takes these as well: its own need the inverse of an error function.
#pragma once

#include "model/half_vector.h"

namespace brdfc::inline model {

/// Facets of one distribution. Directions and normals are above the surface. `folds` is true if the normals that are
/// sampled are those that V-cavities show, which beckmann requires.
template <class T> struct Facets {
  T ax, ay;
  bool is_beckmann, folds;

  T D(const Vec3<T>& h) const {
    if (!is_beckmann) return named("D", T(1) / (pi<T>() * ax * ay * sqr(sqr(h.x / ax) + sqr(h.y / ay) + sqr(h.z))));
    const Slopes<T> s(h);
    return named("D", exp(-(sqr(s.x / ax) + sqr(s.y / ay))) * sqr(s.inverse_cos2()) / (pi<T>() * ax * ay));
  }

  /// (n.w) Lambda.
  T hidden(const Vec3<T>& w) const {
    const T c = maximum(w.z, tiny<T>()), p2 = named("p2", sqr(ax * w.x) + sqr(ay * w.y));
    if (!is_beckmann) return p2 / (T(2) * (sqrt(c * c + p2) + c));
    const T p = sqrt(p2), a = named("a", minimum(c / maximum(p, tiny<T>()), T(1.6)));
    return select(a < T(1.6), p * (T(1) - a * (T(1.259) - T(0.396) * a)) / (T(3.535) + T(2.181) * a), T(0));
  }

  /// Smith's G / (4 (n.i)(n.o)).
  T smith_shape(bool is_correlated, const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T zi = maximum(wi.z, T(0)), zo = maximum(wo.z, T(0)), hi = hidden(wi), ho = hidden(wo);
    const T product = is_correlated ? zi * zo + zi * ho + zo * hi : (zi + hi) * (zo + ho);
    return T(1) / (T(4) * maximum(product, tiny<T>()));
  }

  /// The density of sampled normals over D, times the Jacobian of reflection 1 / (4 (o.h)). `hz` is (n.h).
  T visible(const T& hz, const T& oh, const Vec3<T>& wo) const {
    if (folds) return minimum(T(1) / maximum(wo.z, tiny<T>()), T(2) * hz / oh) / T(4);
    return T(1) / (T(4) * (maximum(wo.z, T(0)) + hidden(wo)));
  }

  /// The density of directions reflected about sampled normals.
  T reflected_pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return select(above(wi, wo), D(k.h) * visible(k.h.z, k.oh, wo), T(0));
  }

  /// A normal that Smith's ggx shows to w.
  Vec3<T> sample_caps(const Vec3<T>& w, const T& u1, const T& u2) const {
    const Vec3<T> k = normalize(Vec3<T>{ax * w.x, ay * w.y, w.z});
    // A direction of the cap of cosines above -k.z: 1 - cosine, without cancellation.
    const T drop = u1 * (T(1) + k.z), sine = sqrt(maximum(drop * (T(2) - drop), T(0)));
    const T phi = named("phi", T(2) * pi<T>() * u2);
    return normalize(Vec3<T>{ax * (k.x + sine * cos(phi)), ay * (k.y + sine * sin(phi)), (T(1) - u1) * (T(1) + k.z)});
  }

  /// A normal, and a number of [0, 1) that is independent of it.
  struct Drawn {
    Vec3<T> h;
    T left;
  };
  Drawn sample_normal(const Vec3<T>& wo, const Vec3<T>& u) const {
    if (!folds) return {sample_caps(wo, u.y, u.z), u.x};
    const Vec3<T> up = {T(0), T(0), T(1)};
    const Vec3<T> h = !is_beckmann ? sample_caps(up, u.y, u.z) : sample_gaussian_slopes(ax, ay, u.y, u.z);
    const Vec3<T> opposite = {-h.x, -h.y, h.z};
    const T one = maximum(dot(wo, h), T(0)), other = maximum(dot(wo, opposite), T(0));
    const T at = u.x * (one + other);
    const auto is_h = at < one;
    const T left = select(is_h, at / maximum(one, tiny<T>()), (at - one) / maximum(other, tiny<T>()));
    return {select(is_h, h, opposite), left};
  }
};

}  // namespace brdfc::inline model
