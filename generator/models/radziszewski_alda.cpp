// SPDX-License-Identifier: GPL-3.0-or-later
// Radziszewski and Alda's energy-conserving family of glossy models: a latitudinal lobe in cos^2 theta times a
// longitudinal lobe in azimuth. It is lossless and reciprocal for every glossiness from matte (n = 0) to mirror
// (n -> infinity).
//
// M. Radziszewski, W. Alda: Family of Energy Conserving Glossy Reflection Models, 2008. Equation numbers are the
// paper's. x = cos^2 theta_i, y = cos^2 theta_r; f = f_theta(x, y) f_phi(phi_i - phi_r), eqs. 4, 17, 18, 19.
// The lobe's centre omega_r is the direction of ideal reflection, of ideal refraction, or back to wo.
//
// Errata. Eqs. 17 and 19 integrate to 1/2, because eq. 8 has R_y = 0.5 integral f dx: f_theta needs a factor 2.
// In eq. 19 the argument of P_5 must be nbar = n_phi sin theta_i sin theta_r, not n_phi.
//
// Numerical stability. f_theta: see latitudinal_lobe.h. f_phi: with k = 2 nbar + 1, q = 1/k, P_5(nbar) / k^5 =
// a^5 + 5 a^3 b^2 + (15/8) a b^4, a = (1+q)/2, b = (1-q)/2.
//
// Refraction. Evaluating the lobe around the refracted direction would be lossless from one side, but neither
// reciprocal nor lossless from the other. Instead, Snell's law maps both directions to the outside, which has the
// smaller refractive index (the index is at least 1), and the lobe is evaluated there. If the light is inside, the
// result is multiplied by the squared index, as solid angles inside are smaller by this factor. Beyond the critical
// angle no light comes from outside. There the reflection lobe distributes the light among the directions beyond the
// critical angle, with stretched heights x = cos^2 theta / X, X = 1 - 1/ior^2. So the model is lossless from both
// sides, and reciprocal up to the squared index.
//
// Sampling phi: tan psi = sqrt(k) tan(dphi/2) transforms the pdf to (cos^2 psi + q sin^2 psi)^5 / (pi P_5/k^5), which
// is bounded for every k. Its CDF is a trigonometric polynomial, which a safeguarded Newton method inverts.
#include "model/latitudinal_lobe.h"

namespace brdfc {

template <class T> struct RadziszewskiAlda {
  T n, n_theta, n_phi;
  Choice proportion, part, around;
  T index;
  Rgb<T> tint;

  enum { Product, Latitudinal, Longitudinal };
  enum { Paper, Equal, Custom };
  enum { Reflection, Refraction, Retro };

  static ModelInfo info() {
    return {.name = "radziszewski_alda",
            .label = "Radziszewski-Alda",
            .look = Look::Glossy,
            .paper = "M. Radziszewski, W. Alda: Family of Energy Conserving Glossy Reflection Models, 2008",
            .equations = "eqs. 17-19; factor 2 and nbar mended",
            .doc = "Glossy reflection or transmission that loses no light at any angle, from matte (0) to mirror.",
            .properties = {.lossless = true, .diffuse_limit = "n=0", .specular_limit = "n=1e8", .fit_axis = "n"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(n, NumberSpec{"n", "Glossiness", 4, 0, 1e8, 0, 100, "Glossiness n: 0 is matte, infinity a mirror"}.by_factors());
    v(n_theta, NumberSpec{"n_theta", "Latitudinal Glossiness", 4, 0, 1e8, 0, 100, "n_theta, for the custom proportion"}
                   .by_factors());
    v(n_phi, NumberSpec{"n_phi", "Longitudinal Glossiness", 4, 0, 1e8, 0, 100, "n_phi, for the custom proportion"}
                 .by_factors());
    v(proportion, ChoiceSpec{"proportion",
                             "Proportion",
                             {"paper", "equal", "custom"},
                             "paper: n_theta = n, n_phi = 0.75 n sqrt(n sin theta_i sin theta_r); equal: both n"});
    v(part, ChoiceSpec{"part", "Part", {"product", "latitudinal", "longitudinal"}, "Which lobes to multiply, eq. 4"});
    v(around,
      ChoiceSpec{"around",
                 "Around",
                 {"reflection", "refraction", "retro"},
                 "Direction the lobe is centred on: of ideal reflection, ideal refraction, or back to the viewer"});
    v(index, NumberSpec{"ior", "IOR", 1.5, 1, 10, 1, 2.5, "Refractive index inside over outside, for refraction"}.as(
                 Optical::Index));
    v(tint, ColorSpec{"tint", "Tint", {1, 1, 1}, "Share of the light that is reflected"}.as(Optical::Tint));
  }

  T latitudinal_n() const { return proportion == Custom ? n_theta : n; }

  /// nbar = n_phi sin theta_i sin theta_r; `sin_sin` is the product of the sines.
  T nbar(const T& sin_sin) const {
    switch (proportion) {
      case Paper:
        return T(0.75) * n * sqrt(n * sin_sin) * sin_sin;
      case Equal:
        return n * sin_sin;
      default:
        return n_phi * sin_sin;
    }
  }

  T ior() const { return index; }
  bool scatters_through() const { return around == Refraction; }

  T f_theta(const Vec3<T>& wi, const Vec3<T>& wr) const { return latitudinal_lobe(latitudinal_n(), wi, wr); }

  /// P_5(nbar) / k^5 with q = 1/k.
  static T p5_over_k5(const T& q) {
    const T a = named("a", (T(1) + q) / T(2)), b = named("b", (T(1) - q) / T(2));
    const T a2 = named("a2", a * a), b2 = named("b2", b * b);
    return a * (a2 * a2 + T(5) * a2 * b2 + T(1.875) * b2 * b2);
  }

  /// Longitudinal lobe, eq. 18; integrates to 1 over the circle.
  T f_phi(const Vec3<T>& wi, const Vec3<T>& wr) const {
    const T si = sqrt(sin2_theta(wi)), sr = sqrt(sin2_theta(wr));
    const T sin_sin = named("sin_sin", si * sr);
    const T nb = named("nbar", nbar(sin_sin));
    // 1 - cos(phi_i - phi_r) as half the squared distance of unit vectors, without cancellation at the peak.
    const T ix = wi.x / maximum(si, tiny<T>()), iy = wi.y / maximum(si, tiny<T>());
    const T rx = wr.x / maximum(sr, tiny<T>()), ry = wr.y / maximum(sr, tiny<T>());
    const T one_minus_cos = named("one_minus_cos", (sqr(ix - rx) + sqr(iy - ry)) / T(2));
    const T k = named("k", T(2) * nb + T(1));
    const T base = nb * one_minus_cos + T(1);
    const T base3 = base * base * base;
    return named("f_phi", sqrt(k) / (T(2) * pi<T>() * p5_over_k5(T(1) / k)) / base3 / base3);
  }

  /// A direction on either side, mapped to the hemisphere in which the refraction lobe is evaluated.
  struct MappedDirection {
    Vec3<T> w;       ///< outside, or with stretched height beyond the critical angle
    Vec3<T> turned;  ///< for the azimuthal lobe: the original one where the height is stretched
    T beyond;        ///< (ior sin)^2 - 1 inside, -1 outside: positive beyond the critical angle
  };
  MappedDirection map_outside(const Vec3<T>& w) const {
    const auto inside = w.z < T(0);
    const T scale = named("scale", select(inside, index, T(1)));
    const T x = scale * w.x, y = scale * w.y;
    const T sine = named("sin_thin", sqrt(x * x + y * y));
    const T cos2 = named("cos2_thin", (T(1) - sine) * (T(1) + sine));
    // With equal indices there is no critical angle, and rounding must not create one.
    const T beyond = named("beyond", select(inside && index > T(1), -cos2, T(-1)));
    const auto total = beyond > T(0);
    // Stretched: sin^2 = ((ior sin)^2 - 1) / (ior^2 - 1), and the squared cosine is cos^2 ior^2 / (ior^2 - 1).
    const T room = maximum((index - T(1)) * (index + T(1)), tiny<T>());
    const T stretch = sqrt(maximum(-cos2, T(0)) / room) / maximum(sine, tiny<T>());
    const T size = named("size", select(total, stretch, T(1)));
    const T height = named("height", select(total, abs(w.z) * index / sqrt(room), sqrt(maximum(cos2, T(0)))));
    return {{x * size, y * size, select(inside, height, abs(w.z))},
            {select(total, w.x, x), select(total, w.y, y), height},
            beyond};
  }

  /// The factor of the lobe if light passes between the two directions, either through the surface or inside beyond the
  /// critical angle; otherwise 0.
  T transport_factor(const Vec3<T>& wi, const MappedDirection& i, const Vec3<T>& wo, const MappedDirection& o) const {
    const T through = select(wi.z < T(0), index * index, T(1));
    const T total = index * index / maximum((index - T(1)) * (index + T(1)), tiny<T>());
    const auto crosses = wi.z * wo.z < T(0) && i.beyond < T(0) && o.beyond < T(0);
    const auto stays = i.beyond > T(0) && o.beyond > T(0);
    return named("passage", select(crosses, through, select(stays, total, T(0))));
  }

  /// Eq. 19 around a direction on the upper side, without tint. `ti` and `tr` are the directions for the azimuthal
  /// lobe.
  T product(const Vec3<T>& wi, const Vec3<T>& wr, const Vec3<T>& ti, const Vec3<T>& tr) const {
    switch (part) {
      case Latitudinal:
        return f_theta(wi, wr) / (T(2) * pi<T>());
      case Longitudinal:
        return T(2) * f_phi(ti, tr);
      default:
        return f_theta(wi, wr) * f_phi(ti, tr);
    }
  }

  /// Eq. 19 without tint; 0 where no light passes.
  T lobe(const Vec3<T>& wi, const Vec3<T>& wo) const {
    if (around == Refraction) {
      const MappedDirection i = map_outside(wi), o = map_outside(wo);
      return transport_factor(wi, i, wo, o) * product(i.w, reflect(o.w), i.turned, reflect(o.turned));
    }
    const Vec3<T> wr = centre(wo);
    return select(above(wi, wo), product(wi, wr, wi, wr), T(0));
  }

  /// The centre of the lobe, for reflection and retroreflection.
  Vec3<T> centre(const Vec3<T>& wo) const { return around == Retro ? wo : reflect(wo); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return tint * lobe(wi, wo); }

  /// The cosine-weighted lobe is itself a pdf.
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return lobe(wi, wo) * abs(wi.z); }

  /// Samples cos^2 theta_i with the pdf f_theta / 2, given y, for u in [0, 1).
  static T sample_cos2(const T& m, const T& y, const T& u) {
    const T v = named("one_minus_u", T(1) - u);
    // x = log1p(-u expm1(-m) / (v e^{-my} + u e^{-m})) / m.
    const T grow = -u * expm1(-m) / maximum(v * exp(-m * y) + u * exp(-m), tiny<T>());
    const T mild = named("mild", log1p(grow) / maximum(m, T(1e-6)));
    // For large m: the difference of ln(u + v e^{-my}) and ln(v e^{-my} + u e^{-m}), each with its larger term factored
    // out.
    const T lu = named("ln_u", log(maximum(u, tiny<T>())));
    const T lv = named("ln_v", log(maximum(v, tiny<T>())));
    const auto logaddexp = [](const T& p, const T& q) { return maximum(p, q) + log1p(exp(-abs(p - q))); };
    const T steep = named("steep", (logaddexp(lu, lv - m * y) - logaddexp(lv - m * y, lu - m)) / maximum(m, T(1)));
    return clamp01(select(m < T(1e-6), u, select(m < T(16), mild, steep)));
  }

  /// Samples (x, 1 - x) given (y, 1 - y). f_theta does not change if x and y are replaced by 1 - x and 1 - y. So the
  /// smaller number of each pair is computed, which keeps it precise both near the normal and near the horizon.
  static std::array<T, 2> sample_x(const T& n, const T& y, const T& one_minus_y, const T& u) {
    const auto near_normal = y > T(0.5);
    const T m = log_cosh2(n);
    const T x = named("x", sample_cos2(m, select(near_normal, one_minus_y, y), select(near_normal, T(1) - u, u)));
    return {select(near_normal, T(1) - x, x), select(near_normal, x, T(1) - x)};
  }

  /// Samples (cos dphi, sin dphi) with the pdf f_phi for k = 2 nbar + 1.
  static std::array<T, 2> sample_phi(const T& k, const T& u) {
    const T q = T(1) / k;
    const T a = named("a", (T(1) + q) / T(2)), b = named("b", (T(1) - q) / T(2));
    const T a2 = named("a2", a * a), b2 = named("b2", b * b);
    // (a + b cos t)^5 = c0 + sum of c_j cos(j t), t = 2 psi.
    const T c0 = named("c0", p5_over_k5(q));
    const T c1 = named("c1", b * (T(5) * a2 * a2 + T(7.5) * a2 * b2 + T(0.625) * b2 * b2));
    const T c2 = named("c2", T(2.5) * a * b2 * (T(2) * a2 + b2));
    const T c3 = named("c3", T(0.3125) * b * b2 * (T(8) * a2 + b2));
    const T c4 = named("c4", T(0.625) * a * b2 * b2);
    const T c5 = named("c5", T(0.0625) * b * b2 * b2);
    // The lobe is even: solves for t in [0, pi] with the probability |2 u - 1|, then restores the sign.
    const T share = named("share", abs(T(2) * u - T(1)));
    const T target = named("target", share * c0 * pi<T>());
    const std::array<T, 3> state = newton_iterate(
        newton_steps<T>(), std::array<T, 3>{T(0), pi<T>(), pi<T>() / T(2) * share}, [&](const std::array<T, 3>& s) {
          const T t = s[2];
          const T C = named("C", cos(t)), S = named("S", sin(t));
          // sin(j t) / sin(t) by Chebyshev's recurrence.
          const T u1 = T(2) * C, u2 = u1 * u1 - T(1), u3 = u1 * u2 - u1, u4 = u1 * u3 - u2;
          const T F = named("F", c0 * t + S * (c1 + c2 * u1 / T(2) + c3 * u2 / T(3) + c4 * u3 / T(4) + c5 * u4 / T(5)));
          const T w = named("w", a + b * C);
          const T dF = w * w * w * w * w;
          return bracketed_newton(s, F - target, dF);
        });
    const T psi = named("psi", state[2] / T(2));
    const T C = cos(psi), S = sin(psi);
    // tan(dphi/2) = tan(psi) / sqrt(k).
    const T c2h = k * C * C, s2h = S * S, norm = c2h + s2h;
    const T cos_dphi = (c2h - s2h) / norm;
    const T sin_dphi = T(2) * sqrt(k) * S * C / norm;
    return {cos_dphi, select(u < T(0.5), -sin_dphi, sin_dphi)};
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const bool refracts = around == Refraction;
    const MappedDirection o = refracts ? map_outside(wo) : MappedDirection{wo, wo, T(-1)};
    const Vec3<T> wr = refracts ? reflect(o.w) : centre(wo);
    const T sr2 = sin2_theta(wr);
    std::array<T, 2> x = {T(1) - u.y, u.y};
    if (part != Longitudinal) x = sample_x(latitudinal_n(), wr.z * wr.z, sr2, u.y);
    T cosTheta = named("cosTheta_i", sqrt(x[0])), sinTheta = named("sinTheta_i", sqrt(x[1]));
    T sr = sqrt(sr2), sine = sinTheta;  // sines for the azimuthal lobe
    if (refracts) {
      // Inverts the mapping of map_outside().
      const auto total = o.beyond > T(0);
      const T room = named("room", (index - T(1)) * (index + T(1)));
      const T beyond_sin = named("beyond_sin", sqrt(x[1] * room + T(1)) / index);
      const T beyond_cos = sqrt(x[0] * maximum(room, T(0))) / index;
      const T inner = sinTheta / index;
      const T inner_cos = sqrt((T(1) - inner) * (T(1) + inner));
      const auto outside = wo.z > T(0);
      sr = sqrt(sin2_theta(o.turned));
      sine = select(total, beyond_sin, sinTheta);
      sinTheta = named("sin_i", select(total, beyond_sin, select(outside, inner, sinTheta)));
      cosTheta = named("cos_i", select(total, -beyond_cos, select(outside, -inner_cos, cosTheta)));
    }
    std::array<T, 2> dphi;
    if (part == Latitudinal) {
      const T angle = T(2) * pi<T>() * u.z;
      dphi = {cos(angle), sin(angle)};
    } else {
      dphi = sample_phi(named("k", T(2) * nbar(sine * sr) + T(1)), u.z);
    }
    // The azimuth of the lobe's centre; arbitrary at normal incidence, where the lobe is isotropic.
    const T so = sqrt(sin2_theta(wo));
    const auto defined = so > T(1e-20);
    const T turn = around == Retro ? T(1) : T(-1);
    const T rx = select(defined, turn * wo.x / maximum(so, T(1e-20)), T(1));
    const T ry = select(defined, turn * wo.y / maximum(so, T(1e-20)), T(0));
    const Vec3<T> wi = {sinTheta * (rx * dphi[0] - ry * dphi[1]), sinTheta * (ry * dphi[0] + rx * dphi[1]), cosTheta};
    if (refracts) return sample_if(abs(wi.z) > T(0), wi, tint, pdf(wi, wo));
    return sample_if(above(wi, wo), wi, tint, pdf(wi, wo));
  }
};

BRDFC_MODEL(RadziszewskiAlda)

}  // namespace brdfc
