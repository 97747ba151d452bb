// SPDX-License-Identifier: GPL-3.0-or-later
// The coupled matte/specular model: a smooth dielectric coat over a matte base, which receives the light that the coat
// transmits.
//
// P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection Models, Pacific
// Graphics 1997. Equation numbers are those of the paper.
// f = R_f(theta_o) delta + k R_m [1 - (1 - cos theta_i)^5] [1 - (1 - cos theta_o)^5] (eq. 5), Schlick's R_f (eq. 1).
//
// Erratum: k = 21 / (20 pi (1 - R_0)) of eq. 4 belongs with [1 - R_f(theta)][1 - R_f(theta')]. Eq. 5 as printed has no
// factors (1 - R_0), so k is 21 (1 - R_0) / (20 pi). Then R_m = 1 loses no light at any angle.
//
// The choice fresnel = dielectric uses the full Fresnel equations and solves for k, as the paper suggests:
//   f = k R_m T T',  T = 1 - R_f,  1/k = 2 pi integral of T(c) c dc.
// The refractive index of the coat follows from the reflectance R_0 at normal incidence. With
// nu = 1 / index = (1 - sqrt R_0) / (1 + sqrt R_0) and g = index cos theta_t = sqrt(1 - nu^2 + nu^2 c^2),
//   r_s = (1 - nu^2) / (nu c + g)^2,  r_p = (1 - nu^2) (c^2 (1 + nu^2) - nu^2) / (c + nu g)^2,
//   T = nu That,  That = 2 c g [1 / (nu c + g)^2 + 1 / (c + nu g)^2],
// without cancellation from R_0 = 0 to 1. The constant is looked up in a table of S(nu) = 2 integral of That c dc,
// which is integrated numerically on first use. The interpolation error is at most 4e-7, relative to S and to the
// albedo. Near 0 the slope of S is that of nu log nu, so the knots are evenly spaced in sqrt(nu).
//
// Sampling inverts eq. 6. The paper's rational starting value has an absolute error of 1.2 %, but its relative error is
// unbounded, and Newton's method converges slowly from it near 0. Below xi = 0.02 the start is c = t (1 + t/2),
// t = cbrt(2 xi / 7), from the leading terms of eq. 6.
#include <boost/math/quadrature/gauss.hpp>

#include "model/sampling.h"
#include "model/under.h"
#include "tables/table.h"

namespace brdfc {

/// S as a function of sqrt(nu).
const std::shared_ptr<const Table>& table_of_S();

/// The coat with the full Fresnel equations.
template <class T> struct FullCoat {
  T nu, w;  ///< w = 1 - nu^2

  explicit FullCoat(const T& r0) {
    const T s = named("sqrt_R0", sqrt(r0));
    nu = named("nu", (T(1) - s) / (T(1) + s));
    w = named("w", T(4) * s / sqr(T(1) + s));
  }
  /// Keeps cosines above 0, where the formulas are 0/0 if nothing is reflected.
  static T guarded(const T& c) { return maximum(c, T(1e-15)); }
  T g(const T& c) const { return named("g", sqrt(w + sqr(nu * c))); }

  T R(const T& cosTheta) const {
    const T c = guarded(cosTheta), gc = g(c);
    const T rs = w / sqr(nu * c + gc), rp = w * (c * c * (T(1) + nu * nu) - nu * nu) / sqr(c + nu * gc);
    return named("R_f", (rs * rs + rp * rp) / T(2));
  }
  /// T / nu
  T That(const T& cosTheta) const {
    const T c = guarded(cosTheta), gc = g(c);
    return named("That", T(2) * c * gc * (T(1) / sqr(nu * c + gc) + T(1) / sqr(c + nu * gc)));
  }
  /// 2 integral of That c dc
  T S() const { return named("S", lookup(table_of_S(), std::array<T, 1>{sqrt(nu)})); }
};

#if BRDFC_BASELINE  // tables are made once
const std::shared_ptr<const Table>& table_of_S() {
  static const std::shared_ptr<const Table> table = [] {
    constexpr int kKnots = 4097;
    std::vector<double> values;
    for (int i = 0; i < kKnots; ++i) {
      FullCoat<double> coat(0);
      coat.nu = sqr(double(i) / (kKnots - 1));
      coat.w = (1 - coat.nu) * (1 + coat.nu);
      // The substitution c = t^3 removes the square root at the horizon.
      values.push_back(boost::math::quadrature::gauss<double, 30>::integrate(
          [&](double t) { return 6 * coat.That(t * t * t) * t * t * t * t * t; }, 0., 1.));
    }
    return make_table("coupled_S", {even_axis("sqrt_nu", kKnots)}, values);
  }();
  return table;
}
#endif

template <class T> struct Coupled {
  T r0;
  Rgb<T> rm;
  Choice fresnel;

  enum { Schlick, Dielectric };

  static ModelInfo info() {
    return {.name = "coupled",
            .label = "Coupled Matte/Specular",
            .look = Look::Glossy,
            .paper =
                "P. Shirley, B. Smits, H. Hu, E. Lafortune: A Practitioners' Assessment of Light Reflection "
                "Models, Pacific Graphics 1997",
            .equations = "eqs. 1, 5, 6; k of eq. 4 mended; or the full Fresnel equations in eq. 3",
            .doc = "Polished surface: a mirror-like coat over a matte base, whose shares trade off with the angle.",
            .properties = {.lossless = true,
                           .exact_sampling = false,  // exact for schlick
                           .specular_limit = "r0=1"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(r0,
      NumberSpec{"r0", "Normal Reflectance", 0.05, 0, 1, 0, 0.2, "Reflectance of the coat at normal incidence, R_0"}.as(
          Optical::Reflectance));
    v(rm, ColorSpec{"rm", "Matte Reflectance", {0.8, 0.8, 0.8}, "Reflectance of the matte base, R_m"});
    v(fresnel, ChoiceSpec{"fresnel",
                          "Fresnel",
                          {"schlick", "dielectric"},
                          "Reflectance of the coat. schlick: approximation, eq. 1; dielectric: Fresnel's equations"});
  }

  /// R_f(theta), by eq. 1 or the full Fresnel equations.
  T R_f(const T& cosTheta) const {
    if (fresnel == Dielectric) return FullCoat<T>(r0).R(cosTheta);
    return r0 + (T(1) - r0) * schlick_weight(cosTheta);
  }

  /// Weight of the mirror term of eq. 5.
  Rgb<T> mirror(const Vec3<T>& wo) const { return Rgb<T>(R_f(wo.z)); }

  static T f(const T& c) { return one_minus_schlick_weight(c); }

  T k() const { return T(21) * (T(1) - r0) / (T(20) * pi<T>()); }

  /// Matte term of eq. 5.
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    if (fresnel == Dielectric) {
      const FullCoat<T> coat(r0);
      const T k = named("k", coat.nu / (pi<T>() * coat.S()));
      return select(above(wi, wo), rm * (k * coat.That(wi.z) * coat.That(wo.z)), Rgb<T>(T(0)));
    }
    return select(above(wi, wo), rm * (k() * f(wi.z) * f(wo.z)), Rgb<T>(T(0)));
  }

  /// The normalised matte term as a function of wi; approximate for the full Fresnel equations.
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), T(21) / (T(20) * pi<T>()) * f(wi.z) * wi.z, T(0));
  }

  /// The cos theta' at which eq. 6 gives xi.
  static T invert_eq6(const T& xi) {
    const T t = named("t", cbrt(T(2) / T(7) * xi));
    const T rational = (((T(38295.9) * xi + T(13002.4)) * xi + T(154.4)) * xi + T(0.0114813)) /
                       (((T(16520.2) * xi + T(33596.4)) * xi + T(1483.57)) * xi + T(1));
    const T start = select(xi < T(0.02), t * (T(1) + t / T(2)), rational);
    const std::array<T, 1> c = iterate(4, std::array<T, 1>{start}, [&](const std::array<T, 1>& state) {
      const T c = state[0];
      const T c2 = c * c;
      const T F = c2 * c * (T(3.5) - c * (T(5.25) - c * (T(4.2) - c * (T(1.75) - T(0.3) * c))));
      const T dF = T(2.1) * c * f(c);
      return std::array<T, 1>{c - (F - xi) / maximum(dF, tiny<T>())};
    });
    return clamp01(c[0]);
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T c = named("cosTheta_i", invert_eq6(u.y));
    const T sinTheta = sqrt((T(1) - c) * (T(1) + c));
    const T phi = T(2) * pi<T>() * u.z;
    const Vec3<T> wi = {sinTheta * cos(phi), sinTheta * sin(phi), c};
    if (fresnel == Dielectric) {
      const FullCoat<T> coat(r0);
      const T shape = coat.That(c) / maximum(T(1.05) * coat.S() * f(c), tiny<T>());
      return sample_if(above(wi, wo), wi, rm * (coat.nu * coat.That(wo.z) * shape), pdf(wi, wo));
    }
    // f cos / pdf = R_m (1 - R_f(theta_o)): the dependence on wi cancels.
    return sample_if(above(wi, wo), wi, rm * ((T(1) - r0) * f(wo.z)), pdf(wi, wo));
  }

  /// Not available with the full Fresnel equations. With s = (1 - c)^5: (1 - s) c = 2 (1 - s/2) c - c. The first term
  /// is Burley's closure at roughness 0, the second a ramp, whose colours may be negative. The ramp is linear in c,
  /// hence exact. Its magnitude is in its colours, so that its weight adds almost nothing to the albedo in the render
  /// passes.
  std::optional<ClosureSum<T>> exact(const Vec3<T>& wo) const {
    if (fresnel == Dielectric) return std::nullopt;
    const Rgb<T> W = named("W", rm * (T(1.05) * (T(1) - r0) * f(wo.z)));
    const T so = named("s_o", schlick_weight(wo.z));
    Closure<T> burley(ClosureKind::Burley, W * (T(2) / (T(1) - so / T(2))));
    const T small = T(kRampWeight);
    Closure<T> ramp(ClosureKind::DiffuseRamp, Rgb<T>(small));
    for (int i = 0; i < kRampSize; ++i) ramp.ramp[std::size_t(i)] = W * (T(-i) / (T(kRampSize - 1) * small));
    return ClosureSum<T>{burley, ramp, Closure<T>(ClosureKind::Reflection, mirror(wo))};
  }

  /// The matte term is a product of a function of wi, which becomes a ramp, and a function of wo. The closure's weight
  /// is the matte term's albedo.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const FullCoat<T> coat(r0);
    const bool full = fresnel == Dielectric;
    const T matte = named("matte", full ? coat.nu * coat.That(wo.z) : (T(1) - r0) * f(wo.z));
    Closure<T> ramp(ClosureKind::DiffuseRamp, rm * matte);
    for (int i = 0; i < kRampSize; ++i) {
      const T c(double(i) / (kRampSize - 1));
      ramp.ramp[std::size_t(i)] = Rgb<T>(full ? coat.That(c) * c / coat.S() : T(1.05) * f(c) * c);
    }
    return {ramp};
  }

  /// With Schlick's coat the matte term by two cones, which have 94 % of it.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const Rgb<T> all = fresnel == Dielectric ? Rgb<T>(T(0)) : rm * (k() * f(wo.z));
    return cones_under(all, {0.9995, 0.711}, {0.4951, 0.9583});
  }

  /// Large enough that Cycles does not drop the closure (as it does at 1e-5), and small beside any relevant albedo.
  static constexpr double kRampWeight = 1e-3;
};

BRDFC_MODEL(Coupled)
BRDFC_UNDER(Coupled)

}  // namespace brdfc
