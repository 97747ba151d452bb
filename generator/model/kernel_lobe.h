// SPDX-License-Identifier: GPL-3.0-or-later
// The construction of Radziszewski and Alda's latitudinal lobe for other kernels: any symmetric positive kernel gives a
// reflection model that loses no light and is reciprocal.
//
// M. Radziszewski, W. Alda: Family of Energy Conserving Glossy Reflection Models, 2008, eqs. 9-16; "this particular
// choice is not unique". x = cos^2 theta_i, y = cos^2 theta_r; the kernel is k(n |x' - y'|) over [0, 1]^2. With A(u)
// the integral of k over [0, u], B that of A, and S(x') = A(n x') + A(n (1 - x')):
//   marginal  M(x') = [B(n x') + B(n) - B(n (1 - x'))] / (2 B(n)), its density n S(x') / (2 B(n)),
//   lobe      f_theta(x, y) = 4 B(n) k(n |x' - y'|) / (S(x') S(y')),  M(x') = x, M(y') = y.
// This is eq. 13 inserted into eq. 9, with the factor 2 that eq. 8 requires. k = sech^2 gives eq. 17. A kernel may also
// be drawn as a curve: linear between its knots and constant beyond the last. Its integrals are sums over the pieces.
//
// Numerical stability: v = n x' is computed in the half where it is small, from the smaller of x and 1 - x.
// B(n) - B(n - v) and 1 - A have their own formulas for each kernel, because the differences would cancel. Newton's
// method stays in a bracket. The upper limit of n is 1e4: places reach n / 2, and from 1e5 on single precision leaves
// too few digits for the kernel.
//
// Sampling: w = A(n (x' - y')) is linear in the random number, so only A has to be inverted, which is possible in
// closed form; then x = M(x').
#pragma once

#include <vector>

#include "model/sampling.h"

namespace brdfc::inline model {

/// Knots at 0, 1, 2, ...: the curves for which a shader has sockets.
template <class T, int Count> struct EvenKnots {
  static constexpr int kNewtonSteps = 20;
  std::array<T, std::size_t(Count)> heights;

  static constexpr int count() { return Count; }
  static T at(int i) { return T(i); }
};

/// Knots at any increasing positions from 0, in any number; only for numbers, not for recordings.
template <class T> struct FreeKnots {
  static constexpr int kNewtonSteps = 60;
  std::vector<T> places, heights;

  int count() const { return int(heights.size()); }
  T at(int i) const { return places[std::size_t(i)]; }
};

/// A kernel drawn as a curve: linear between its knots, constant beyond the last.
template <class T, class Knots> struct DrawnKernel : Knots {
  using Knots::heights;

  int last() const { return Knots::count() - 1; }
  T height(int i) const { return heights[std::size_t(i)]; }
  T width(int i) const { return Knots::at(i + 1) - Knots::at(i); }

  /// The kernel at x, which must lie in piece i.
  T inside(int i, const T& x) const {
    if (i == last()) return height(i);
    return (height(i) * (Knots::at(i + 1) - x) + height(i + 1) * (x - Knots::at(i))) / width(i);
  }
  T k(const T& u) const {
    T value = inside(0, minimum(u, Knots::at(1)));
    for (int i = 1; i <= last(); ++i)
      value = select(u > Knots::at(i), inside(i, i < last() ? minimum(u, Knots::at(i + 1)) : u), value);
    return named("k", value);
  }
  /// A(u) and B(u), selected by the piece that contains u. They are sums of positive terms, exact for these curves.
  std::array<T, 2> integrals(const T& u) const {
    T t = u, left = height(0), right = height(1), span = width(0), area(0), moment(0), whole_area(0), whole_moment(0);
    for (int i = 1; i <= last(); ++i) {
      // Adds the previous piece: its own integrals, and the area before it.
      const T w = width(i - 1);
      whole_moment = whole_moment + whole_area * w + (T(2) * height(i - 1) + height(i)) / T(6) * (w * w);
      whole_area = whole_area + (height(i - 1) + height(i)) / T(2) * w;
      const auto past = u > Knots::at(i);
      t = select(past, u - Knots::at(i), t);
      left = select(past, height(i), left);
      right = select(past, height(std::min(i + 1, last())), right);
      if (i < last()) span = select(past, width(i), span);
      area = select(past, whole_area, area);
      moment = select(past, whole_moment, moment);
    }
    // Beyond the last knot both ends have the same height, so that t and the span do not matter.
    const T rise = t * (right - left) / span;
    return {named("area", area + t * (left + left + rise) / T(2)),
            named("moment", moment + t * (area + t * (T(3) * left + rise) / T(6)))};
  }
  /// The integral of (b - x) k over [a, b], as a sum of positive terms.
  T moment(const T& a, const T& b) const {
    T sum(0);
    for (int i = 0; i <= last(); ++i) {
      T lo = maximum(a, Knots::at(i)), hi = maximum(b, Knots::at(i));
      if (i < last()) lo = minimum(lo, Knots::at(i + 1)), hi = minimum(hi, Knots::at(i + 1));
      const T at_lo = inside(i, lo), at_hi = inside(i, hi);
      // Simpson's rule. Pieces outside [a, b] have no width.
      const T from_lo = maximum(b - lo, T(0)), from_hi = maximum(b - hi, T(0));
      sum = sum + (hi - lo) * (from_lo * at_lo + (from_lo + from_hi) * (at_lo + at_hi) + from_hi * at_hi) / T(6);
    }
    return named("moment", sum);
  }
  /// The u with A(u) = q. Each piece gives a quadratic equation.
  T invert_A(const T& q) const {
    T rest = q, u(0);
    for (int i = 0; i < last(); ++i) {
      const T h = height(i), rise = height(i + 1) - h, w = width(i);
      const T part = minimum(rest, (h + rise / T(2)) * w);
      u = u + T(2) * part / (h + sqrt(maximum(h * h + T(2) * rise * part / w, T(0))));
      rest = rest - part;
    }
    return u + maximum(rest, T(0)) / height(last());
  }
};

/// The lobe of a kernel. A model gives the parameters their names.
template <class T, class Knots> struct KernelLobe {
  Choice kernel;
  T n;
  DrawnKernel<T, Knots> drawn;
  Rgb<T> tint;

  enum { Sech2, Exponential, Table };

  /// e^v - 1 - v, by halving: e^v - 1 - v = (e^(v/2) - 1)^2 + 2 (e^(v/2) - 1 - v/2), where all terms have the same
  /// sign.
  static T psi(const T& v) {
    T sum(0), scale(1), z = v;
    for (int i = 0; i < 4; ++i) {
      z = z / T(2);
      sum = sum + scale * sqr(expm1(z));
      scale = scale * T(2);
    }
    // For |z| <= 1/16 the rest of the series is below 1e-17.
    const T series =
        z * z / T(2) *
        (T(1) +
         z / T(3) *
             (T(1) +
              z / T(4) *
                  (T(1) +
                   z / T(5) *
                       (T(1) +
                        z / T(6) * (T(1) + z / T(7) * (T(1) + z / T(8) * (T(1) + z / T(9) * (T(1) + z / T(10)))))))));
    return sum + scale * series;
  }

  /// n with a tiny lower limit, which prevents 0 / 0 and changes no digit of the result.
  T clamped_n() const { return named("n_pos", maximum(n, T(1e-17))); }

  T k(const T& u) const {
    if (kernel == Table) return drawn.k(u);
    const T e = exp(-u);
    if (kernel == Exponential) return e;
    return sqr(T(2) * e / (T(1) + e * e));
  }
  /// A(u) for u >= 0.
  T A(const T& u) const {
    if (kernel == Table) return drawn.integrals(u)[0];
    if (kernel == Exponential) return -expm1(-u);
    const T e = expm1(T(-2) * u);
    return -e / (T(2) + e);
  }
  /// 1 - A(u).
  T one_minus_A(const T& u) const {
    const T e = exp(-u);
    if (kernel == Exponential) return e;
    return T(2) * e * e / (T(1) + e * e);
  }
  T B(const T& u) const {
    if (kernel == Table) return drawn.integrals(u)[1];
    const T small = minimum(u, T(1)), large = maximum(u, T(1));
    if (kernel == Exponential) return select(u < T(1), psi(-small), large + expm1(-large));
    const T sinh = stable_sinh(small);
    return select(u < T(1), log1p(sinh * sinh) / T(2), large + log1p(exp(T(-2) * large)) - T(0.69314718055994530942));
  }
  /// B(g) - B(g - v) for 0 <= v <= g/2.
  T drop(const T& g, const T& v) const {
    if (kernel == Table) return v * A(g - v) + drawn.moment(g - v, g);
    const T small = minimum(v, T(1));
    if (kernel == Exponential) {
      // v (1 - e^-g) - e^-g psi(v), where for large v e^-g psi(v) = e^(v-g) - e^-g (1 + v).
      const T tail = select(v < T(1), exp(-g) * psi(small), exp(v - g) - exp(-g) * (T(1) + v));
      return -v * expm1(-g) - tail;
    }
    // ln cosh g - ln cosh(g - v) = -ln(cosh v - tanh g sinh v) for small g; for large g with e^(2v - 2g).
    const T sinh_half = stable_sinh(small / T(2)), sinh = stable_sinh(small);
    const T near = -log1p(T(2) * sinh_half * sinh_half - A(minimum(g, T(1))) * sinh);
    const T far = v - log1p(exp(T(2) * (v - g)) * -expm1(T(-2) * v) / (T(1) + exp(T(-2) * g)));
    return select(g < T(1), near, far);
  }

  /// The v = g x' with M(x') = p, for p <= 1/2. For a kernel that decreases with the distance, the root is between g p
  /// and 2 g p, so that each Newton step doubles the number of digits from the start: eight steps suffice for any type.
  /// A drawn kernel may increase, and takes more.
  T invert_marginal(const T& g, const T& p) const {
    const T target = named("target", T(2) * B(g) * p);
    const std::array<T, 3> state =
        newton_iterate(kernel == Table ? Knots::kNewtonSteps : 8, std::array<T, 3>{T(0), g / T(2), g * p},
                       [&](const std::array<T, 3>& s) {
                         const T v = s[2];
                         T F, dF;
                         if (kernel == Table) {
                           const std::array<T, 2> near = drawn.integrals(v);
                           const T far = A(g - v);
                           F = near[1] + v * far + drawn.moment(g - v, g);
                           dF = near[0] + far;
                         } else {
                           F = named("F", B(v) + drop(g, v));
                           dF = A(v) + A(g - v);
                         }
                         return bracketed_newton(s, F - target, dF);
                       });
    return state[2];
  }

  /// The place of a direction on the kernel's axis: the distance v to the nearer end, and which end that is.
  struct Place {
    T v, low;  ///< low: 1 at the horizon's end, 0 at the normal's
  };
  Place place(const T& g, const Vec3<T>& w) const {
    const T x = w.z * w.z, y = sin2_theta(w);
    // If the direction is not exactly normalised, p must still not exceed 1/2.
    const T p = minimum(minimum(x, y) / (x + y), T(0.5));
    return {invert_marginal(g, p), select(x < y, T(1), T(0))};
  }
  T S(const T& g, const T& v) const { return A(v) + A(g - v); }

  /// f_theta / (2 pi).
  T lobe(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T g = clamped_n();
    const Place i = place(g, wi), o = place(g, wo);
    const T same = abs(i.v - o.v), across = maximum(g - i.v - o.v, T(0));
    const T near = select(i.low + o.low < T(1.5) && i.low + o.low > T(0.5), across, same);
    // Far from both ends, and beyond a drawn kernel's last knot, S is constant. There the difference of the places is
    // the difference of the directions divided by S; subtracting large places would lose digits.
    const T x_minus_y = select(wi.z + wo.z < T(1), (wi.z - wo.z) * (wi.z + wo.z),
                               (wo.x - wi.x) * (wo.x + wi.x) + (wo.y - wi.y) * (wo.y + wi.y));
    const T far = abs(x_minus_y) * (T(2) * B(g) / S(g, i.v));
    const T calm = kernel == Table ? maximum(T(40), drawn.at(drawn.last())) : T(40);
    const T u = named("u", select(minimum(i.v, o.v) > calm, far, near));
    // The division by S S is done in two steps, because B is large with g and small with g^2.
    return T(2) * (B(g) / S(g, i.v)) * (k(u) / S(g, o.v)) / pi<T>();
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return tint * select(above(wi, wo), lobe(wi, wo), T(0)); }

  /// The cosine-weighted lobe is itself a pdf.
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), lobe(wi, wo) * wi.z, T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T g = clamped_n();
    const Place o = place(g, wo);
    // Along the axis, wo is at distance r from the nearer end and at distance g - r from the other.
    const T r = o.v, rest = g - r;
    const T total = A(r) + A(rest);
    // w = A(n (x' - y')). For kernels whose A approaches 1, also 1 + w and 1 - w, which are more precise when w is near
    // -1 or 1.
    const T w = named("w", u.y * total - A(r)), mild = minimum(maximum(w, T(-0.75)), T(0.75));
    const T up = one_minus_A(r) + u.y * total, down = one_minus_A(rest) + (T(1) - u.y) * total;
    const auto log_of = [](const T& v) { return log(maximum(minimum(v, T(1)), tiny<T>())); };
    T near, far;
    if (kernel == Table) {
      near = drawn.invert_A(abs(w)) * select(w < T(0), T(-1), T(1));
      far = near;
    } else if (kernel == Exponential) {
      near = select(w < T(0), log1p(mild), -log1p(-mild));
      far = select(up < down, log_of(up), -log_of(down));
    } else {
      near = T(0.5) * (log1p(mild) - log1p(-mild));
      far = T(0.5) * log(maximum(up, tiny<T>()) / maximum(down, tiny<T>()));
    }
    const T step = named("step", select(abs(w) < T(0.5), near, far));
    const T v = minimum(maximum(r + step, T(0)), g);
    // x = M(x'), computed from the nearer end.
    const auto crossed = v > g / T(2);
    const T from_end = select(crossed, g - v, v);
    const T p = clamp01((B(from_end) + drop(g, from_end)) / (T(2) * B(g)));
    const auto low = select(crossed, T(1) - o.low, o.low) > T(0.5);
    const T x = select(low, p, T(1) - p), y = select(low, T(1) - p, p);
    const T phi = T(2) * pi<T>() * u.z;
    const T s = sqrt(y);
    const Vec3<T> wi = {s * cos(phi), s * sin(phi), sqrt(x)};
    return sample_if(above(wi, wo), wi, tint, pdf(wi, wo));
  }
};

}  // namespace brdfc::inline model
