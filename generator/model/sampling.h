// SPDX-License-Identifier: GPL-3.0-or-later
// Sampling functions that several models share.
#pragma once

#include <utility>

#include "model/model.h"

namespace brdfc::inline model {

/// The same as iterate() for Newton's method on the last number of the state, but for numbers it stops when the result
/// no longer changes. After a step of 1e-10 only rounding errors remain in double precision, and further steps would
/// wander among them.
template <Numeric T, std::size_t N, class Step>
std::array<T, N> newton_iterate(int count, std::array<T, N> state, Step step) {
  for (int i = 0; i < count; ++i) {
    const std::array<T, N> last = std::exchange(state, step(state));
    if (std::same_as<T, double> ? abs(state[N - 1] - last[N - 1]) <= T(1e-10) * abs(state[N - 1]) : state == last)
      break;
  }
  return state;
}
/// Each lane stops by itself: its result does not depend on its neighbours.
template <std::size_t N, class Step>
std::array<Pack, N> newton_iterate(int count, const std::array<Pack, N>& begin, Step step) {
  std::array<Pack, N> state = begin;
  Mask settled(false);
  for (int i = 0; i < count && !settled.all(); ++i) {
    const std::array<Pack, N> next = step(state);
    const Mask ends = abs(next[N - 1] - state[N - 1]) <= Pack(1e-10) * abs(next[N - 1]);
    for (std::size_t n = 0; n < N; ++n) state[n] = select(settled, state[n], next[n]);
    settled = settled || ends;
  }
  return state;
}
template <std::size_t N, class Step>
std::array<Expr, N> newton_iterate(int count, const std::array<Expr, N>& state, Step step) {
  return iterate(count, state, step);
}

/// The next state (low, high, v) of Newton's method for an increasing function of v >= 0 with its root in the bracket:
/// `off` is its value and `slope` its derivative at v. The middle of the bracket is taken where the step leaves it by
/// more than rounding does: near the root the middle would be far off, and the last of a fixed number of steps is not
/// mended by another.
template <class T> std::array<T, 3> bracketed_newton(const std::array<T, 3>& s, const T& off, const T& slope) {
  const T v = s[2];
  const auto below = off < T(0);
  const T lo = select(below, v, s[0]), hi = select(below, s[1], v);
  const T newton = named("newton", v - off / maximum(slope, tiny<T>()));
  const auto inside = newton >= T(0.9999) * lo && newton <= T(1.0001) * hi;
  return {lo, hi, select(inside, newton, (lo + hi) / T(2))};
}

/// True if both directions are above the surface; elsewhere the BRDF is 0.
template <class T> auto above(const Vec3<T>& wi, const Vec3<T>& wo) { return wi.z > T(0) && wo.z > T(0); }

/// Ideal reflection of wo about the normal.
template <class T> Vec3<T> reflect(const Vec3<T>& wo) { return {-wo.x, -wo.y, wo.z}; }

/// a + b for unit vectors, a multiple of their half vector. For nearly opposite vectors the plain sum would consist
/// mainly of the errors of their lengths. The exact sum is orthogonal to a - b, so the component along a - b is such an
/// error and is subtracted.
template <class T> Vec3<T> sum_of_units(const Vec3<T>& a, const Vec3<T>& b) {
  const Vec3<T> s = a + b, d = a - b;
  return s - d * (dot(s, d) / maximum(dot(d, d), T(1)));
}

/// a - b for unit vectors, corrected likewise. Near the normal this restores the z component that the rounded cosines
/// have lost.
template <class T> Vec3<T> difference_of_units(const Vec3<T>& a, const Vec3<T>& b) {
  const Vec3<T> s = a + b, d = a - b;
  return d - s * (dot(s, d) / maximum(dot(s, s), T(1)));
}

/// Ideal refraction of wo to the other side of the surface. `ior` is the index inside (z < 0) divided by the one
/// outside. Beyond the critical angle the result is parallel to the surface.
template <class T> Vec3<T> refract(const Vec3<T>& wo, const T& ior) {
  const auto outside = wo.z > T(0);
  const T scale = select(outside, T(1) / ior, ior);
  const T x = -scale * wo.x, y = -scale * wo.y;
  const T cosTheta = sqrt(maximum(T(1) - x * x - y * y, T(0)));
  return {x, y, select(outside, -cosTheta, cosTheta)};
}

/// cos(theta) / pi for a direction above the surface.
template <class T> T cosine_pdf(const Vec3<T>& wi) { return select(wi.z > T(0), wi.z / pi<T>(), T(0)); }

/// A direction with the pdf cos(theta) / pi; u1 determines the height, u2 the azimuth.
template <class T> Vec3<T> sample_cosine(const T& u1, const T& u2) {
  const T phi = named("phi", T(2) * pi<T>() * u2);
  const T sinTheta = named("sinTheta", sqrt(u1));
  return {sinTheta * cos(phi), sinTheta * sin(phi), sqrt(maximum(T(1) - u1, T(0)))};
}

/// A direction above the surface, uniform with the probability `level` and else with the pdf cos(theta) / pi: the pdf
/// (level + 2 (1 - level) cos(theta)) / (2 pi) does not vanish at the horizon. `level` must be above 0.
template <class T> Vec3<T> sample_everywhere(const T& u1, const T& u2, const T& level = T(0.5)) {
  // Solves u1 = (1 - level) c^2 + level c without cancellation.
  const T twice = T(2) * level;
  const T c = T(4) * u1 / (twice + sqrt(twice * twice + T(16) * (T(1) - level) * u1)),
          sinTheta = sqrt(maximum(T(1) - c * c, T(0)));
  const T phi = T(2) * pi<T>() * u2;
  return {sinTheta * cos(phi), sinTheta * sin(phi), c};
}
template <class T> T everywhere_pdf(const Vec3<T>& wi, const T& level = T(0.5)) {
  return select(wi.z > T(0), (T(2) * level + T(4) * (T(1) - level) * wi.z) / (T(4) * pi<T>()), T(0));
}

/// sinh x without cancellation, for x small enough that e^x does not overflow.
template <class T> T stable_sinh(const T& x) {
  const T half = expm1(x) / T(2);
  return half + half / (T(2) * half + T(1));
}

/// A sample with weight and pdf set to 0 unless `exists` is true.
template <class Flag, class T>
Sample<T> sample_if(const Flag& exists, const Vec3<T>& wi, const Rgb<T>& weight, const T& pdf) {
  return {wi, select(exists, weight, Rgb<T>(T(0))), select(exists, pdf, T(0))};
}

/// (1 - c)^5, the angular part of Schlick's Fresnel approximation.
template <class T> T schlick_weight(const T& cosTheta) { return pow5(clamp01(T(1) - cosTheta)); }

/// 1 - (1 - c)^5. For small c it is evaluated as a polynomial, which has no cancellation there but has near 1.
template <class T> T one_minus_schlick_weight(const T& c) {
  const T polynomial = c * (T(5) - c * (T(10) - c * (T(10) - c * (T(5) - c))));
  return select(c < T(0.25), polynomial, T(1) - pow5(T(1) - c));
}

}  // namespace brdfc::inline model
