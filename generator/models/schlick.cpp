// SPDX-License-Identifier: GPL-3.0-or-later
// Schlick's rational model, whose roughness goes from mirror over glossy to Lambertian.
//
// C. Schlick: An Inexpensive BRDF Model for Physically-based Rendering, Computer Graphics Forum 13(3), 1994 (an earlier
// version in A Customizable Reflectance Model for Everyday Rendering, EG Workshop on Rendering 1993).
// With t = n.h, u = o.h, v = n.o, v' = n.i, and w the cosine of the angle between the tangent and the projection of h,
//   f = S(u) (a / pi + b / (4 pi v v') G(v) G(v') Z(t) A(w)) + S(v) c delta,   S(u) = r + (1 - r) (1 - u)^5,
//   Z(t) = s / (1 + s t^2 - t^2)^2,   A(w) = sqrt(p / (p^2 - p^2 w^2 + w^2)),   G(v) = v / (s - s v + v),
//   b = 4 s (1 - s), the rest a for s >= 1/2, c for s < 1/2,   s the roughness, p the isotropy.
//
// The light that G blocks is lost here. The paper offers to add it as (1 - G G') / (4 pi v v'), but the albedo of that
// term is unbounded towards grazing angles. Z (n.h) A integrates to pi for p = 1 only: the mean of A over azimuths is
// (2 / pi) sqrt(p) K(sqrt(1 - p^2)) (K: complete elliptic integral), so that anisotropy loses light. With a strong
// mirror term the model gains some light at grazing angles: with r = 1, p = 1, s = 0.05 the albedo is 1.11 at v = 0.02.
//
// f has no edges. But with p < 1 its limit at h = n depends on the azimuth of the approach, because of A.
//
// Numerical stability: 1 + s t^2 - t^2 = sin^2 theta_h + s t^2; G(v) / v = 1 / (s (1 - v) + v).
//
// Sampling. The integral of sqrt(p) A has no elementary inverse. But A / (2 pi) is the geometric mean of the uniform
// pdf and q = p / (2 pi (p^2 sin^2 + cos^2)), so it is at most their arithmetic mean. That mean is sampled, and weights
// stay below S.
#include "model/base_terms.h"
#include "model/fresnel.h"
#include "model/half_vector.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Schlick {
  Rgb<T> r;
  T p, rough;

  static ModelInfo info() {
    return {.name = "schlick",
            .label = "Schlick",
            .look = Look::Glossy,
            .paper =
                "C. Schlick: An Inexpensive BRDF Model for Physically-based Rendering, Computer Graphics Forum 13(3), "
                "1994",
            .equations = "f = S (a / pi + b G G' Z A / (4 pi v v') + c delta)",
            .doc = "Rational approximation of a microfacet model: Lambertian, glossy and mirror-like by one roughness.",
            .properties = {.conserving = false,
                           .isotropic = false,
                           .exact_sampling = false,
                           .diffuse_limit = "r=1 rough=1",
                           .specular_limit = "rough=0",
                           .fit_axis = "rough"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(r, ColorSpec{"r", "Reflectance", {0.8, 0.8, 0.8}, "Reflectance at normal incidence, r"}.as(Optical::Reflectance));
    v(p, NumberSpec{"p", "Isotropy", 1, 0.01, 1, 0.05, 1,
                    "1 is isotropic; smaller stretches the highlight across the tangent"});
    v(rough,
      NumberSpec{"rough", "Roughness", 0.2, 0, 1, 0.01, 1, "0 is a mirror, 1 Lambertian but for the Fresnel term"}
          .by_factors());
  }

  Rgb<T> S(const T& one_minus_u) const { return named("S", schlick_fresnel(r, one_minus_u)); }

  T b() const { return named("b", T(4) * rough * (T(1) - rough)); }
  T a() const { return named("a", select(rough < T(0.5), T(0), sqr(T(2) * rough - T(1)))); }
  T c() const { return named("c", select(rough < T(0.5), sqr(T(1) - T(2) * rough), T(0))); }

  Rgb<T> mirror(const Vec3<T>& wo) const { return S(clamp01(T(1) - wo.z)) * c(); }

  /// Z(t) / pi. The lobe stops growing below a roughness of 1e-16, because the division by o.h at grazing angles would
  /// overflow in single precision. At that roughness the lobe's share b is below the rounding error of c.
  T Z(const Vec3<T>& h, const T& sin2) const {
    const T d = maximum(sin2 + rough * (h.z * h.z), T(1e-16));
    return named("Z", rough / d / d / pi<T>());
  }
  /// A(w)^2 / p.
  T A2(const Vec3<T>& h, const T& sin2) const {
    const T s2 = maximum(sin2, tiny<T>());
    const T squared = (p * p * (h.y * h.y) + h.x * h.x) / s2;
    return named("A2", select(sin2 < tiny<T>(), T(1) / p, T(1) / maximum(squared, p * p)));
  }
  /// G(v) / v.
  T G(const T& v) const { return T(1) / maximum(rough * (T(1) - v) + v, tiny<T>()); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    const T sin2 = named("sin2_h", sin2_theta(k.h));
    const T glossy = b() / T(4) * Z(k.h, sin2) * sqrt(p * A2(k.h, sin2)) * G(wi.z) * G(wo.z);
    return S(k.one_minus_oh) * select(above(wi, wo), a() / pi<T>() + glossy, T(0));
  }

  /// The pdf of half vectors with density Z(t) t; in azimuth, the mean of both pdfs.
  T glossy_pdf(const HalfVector<T>& k) const {
    const T sin2 = named("sin2_h", sin2_theta(k.h));
    return Z(k.h, sin2) * k.h.z * (T(1) + p * A2(k.h, sin2)) / (T(8) * k.oh);
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T share = a();
    return select(above(wi, wo), share * cosine_pdf(wi) + (T(1) - share) * glossy_pdf(HalfVector<T>(wi, wo)), T(0));
  }

  Vec3<T> sample_glossy(const Vec3<T>& wo, const T& which, const T& u1, const T& u2) const {
    // t^2 = u / (s (1 - u) + u), sin^2 = s (1 - u) / (s (1 - u) + u), where u1 replaces 1 - u.
    const T v = T(1) - u1;
    const T norm = maximum(rough * u1 + v, tiny<T>());
    const T sinTheta = named("sinTheta_h", sqrt(rough * u1 / norm)), cosTheta = named("cosTheta_h", sqrt(v / norm));
    const T phi = named("phi", T(2) * pi<T>() * u2);
    // q is the azimuth of a uniform point on a circle after scaling across the tangent by p.
    const T x = cos(phi) * select(which < T(0.5), p, T(1)), y = sin(phi);
    const T len = sqrt(x * x + y * y);
    const Vec3<T> h = {sinTheta * x / len, sinTheta * y / len, cosTheta};
    return h * (T(2) * dot(wo, h)) - wo;
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T share = a();
    const auto matte_lobe = u.x < share;
    const T rest = (u.x - share) / maximum(T(1) - share, T(1e-6));
    const Vec3<T> matte = sample_cosine(u.y, u.z), glossy = sample_glossy(wo, rest, u.y, u.z);
    const Vec3<T> wi = select(matte_lobe, matte, glossy);
    const T density = pdf(wi, wo);
    return sample_if(density > T(0), wi, eval(wi, wo) * (wi.z / maximum(density, tiny<T>())), density);
  }

  /// Z is the GGX distribution with alpha^2 = s. A varies the brightness with the azimuth without widening the lobe,
  /// and loses light: it is approximated by slightly anisotropic, slightly weaker microfacets.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T reach2 = named("reach2", rough * sin2_theta(wo));
    const Rgb<T> F = S(clamp01(T(1) - lobe_height(wo.z, reach2)));
    // Makes the peaks of f cos equal: the closure's is Z / (4 z sqrt(1 + s tan^2)), because of its own masking.
    const T z = lobe_height(wo.z, T(0.2) * reach2);
    const T peak = sqr(G(z)) * z * sqrt(z * z + reach2);
    const T wide = sqrt(rough), thin = named("thin", exp(T(0.18) * log(p)));
    return {facets(ClosureKind::Ggx, F * (b() * thin * peak), wide * thin, wide / thin, T(0)),
            Closure<T>(ClosureKind::Diffuse, r * a())};
  }

  /// S is at least r, and A sqrt(p) at least sqrt(p). The facets of base() are masked by 1 / (1 + Lambda(v') +
  /// Lambda(v)), and v' G(v') (1 + Lambda(v')), from the horizon on, is at least the lesser of 1 - 0.47 s and of its
  /// value there, 1 / (2 sqrt(s)), to half a percent.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T wide = sqrt(rough);
    const T masking = T(0.995) * minimum(T(1) - T(0.47) * rough, T(0.5) / maximum(wide, T(1e-8)));
    Closure<T> glossy = facets(ClosureKind::Ggx, r * (b() * sqrt(p) * G(wo.z) * wo.z * masking), wide);
    // Random directions meet what narrow lobes do, and Cycles takes the narrowest for mirrors.
    glossy.weight = select(rough < T(1e-3), Rgb<T>(T(0)), glossy.weight);
    return {glossy, Closure<T>(ClosureKind::Diffuse, r * a())};
  }
};

BRDFC_MODEL(Schlick)
BRDFC_UNDER(Schlick)

}  // namespace brdfc
