// SPDX-License-Identifier: GPL-3.0-or-later
// Oren and Nayar's rough diffuse surface: Lambertian microfacets in V-shaped cavities.
//
// M. Oren, S. Nayar: Generalization of Lambert's Reflectance Model, SIGGRAPH 1994. With alpha the larger and beta the
// smaller polar angle, c the cosine of the azimuth difference, and s = sigma^2:
//   full:        f = rho / pi [C1 + c C2 tan beta + (1 - |c|) C3 tan((alpha + beta) / 2)]
//                    + 0.17 rho^2 / pi s / (s + 0.13) [1 - c (2 beta / pi)^2],
//                C1 = 1 - 0.5 s / (s + 0.33), C3 = 0.125 s / (s + 0.09) (4 alpha beta / pi^2)^2,
//                C2 = 0.45 s / (s + 0.09) times sin alpha for c >= 0, sin alpha - (2 beta / pi)^3 below;
//   qualitative: f = rho / pi [C1 + 0.45 s / (s + 0.09) max(c, 0) sin alpha tan beta].
//
// These formulas are fits to an integral, and have flaws: with rho = 1 the albedo exceeds 1 at grazing angles (by up to
// 1.5 % qualitative, 4.8 % full); f is unbounded where both directions graze; and beyond sigma = 0.664 (38 degrees) the
// full form is negative opposite to the light at grazing angles, so sigma is limited to less.
//
// Numerical stability. c sin alpha tan beta = (scalar product of the horizontal components) / max(cos);
// tan((alpha + beta) / 2) = (sin alpha + sin beta) / (cos alpha + cos beta). Angles are 2 atan(sin / (1 + cos)), and
// 1 - 2 beta / pi is computed likewise from the complementary angle. 1 - |c| is half the squared distance of the unit
// vectors at the two azimuths (for c < 0 with one of them negated). On the side opposite to the light,
// sin alpha - (2 beta / pi)^3 is computed from 1 - 2 beta / pi and 1 - sin alpha.
#include "model/base_terms.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct OrenNayar {
  Rgb<T> rho;
  T sigma;
  Choice form;

  enum { Full, Qualitative };

  static ModelInfo info() {
    return {.name = "oren_nayar",
            .label = "Oren-Nayar",
            .look = Look::Matte,
            .paper = "M. Oren, S. Nayar: Generalization of Lambert's Reflectance Model, SIGGRAPH 1994",
            .equations = "eqs. of section 4.3 (full) and 4.4 (qualitative)",
            .doc = "Rough matte surface, as clay or the moon: flatter than Lambert's, bright towards the light.",
            .properties = {.conserving = false,
                           .smooth = false,  // kinks where the angles are equal and in |c| or max(c, 0)
                           .exact_sampling = false,
                           .diffuse_limit = "sigma=0",
                           .fit_axis = "sigma"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.8, 0.8, 0.8}, "Albedo of the facets"});
    v(sigma,
      NumberSpec{"sigma", "Roughness", 0.3, 0, 0.66, 0, 0.66, "Standard deviation of the facets' slope angle", "rad"});
    v(form, ChoiceSpec{
                "form", "Form", {"full", "qualitative"}, "full: with interreflection; qualitative: the short formula"});
  }

  /// s / (s + k).
  T share(double k) const { return sigma * sigma / (sigma * sigma + T(k)); }
  T C1() const { return T(1) - T(0.5) * share(0.33); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), form == Full ? full(wi, wo) : qualitative(wi, wo), Rgb<T>(T(0)));
  }

  Rgb<T> qualitative(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T side = wi.x * wo.x + wi.y * wo.y;
    const T B = T(0.45) * share(0.09);
    return rho * ((C1() + B * maximum(side, T(0)) / maximum(maximum(wi.z, wo.z), tiny<T>())) / pi<T>());
  }

  Rgb<T> full(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T si = named("si", sqrt(sin2_theta(wi))), so = named("so", sqrt(sin2_theta(wo)));
    const auto wi_lower = wi.z < wo.z;
    const T sin_a = named("sin_alpha", select(wi_lower, si, so)), sin_b = named("sin_beta", select(wi_lower, so, si));
    const T cos_a = minimum(wi.z, wo.z), cos_b = named("cos_beta", maximum(maximum(wi.z, wo.z), tiny<T>()));
    // Angles in units of a right angle.
    const auto over_right = [](const T& s, const T& c) { return T(4) / pi<T>() * atan(s / (T(1) + maximum(c, T(0)))); };
    const T alpha = named("alpha", over_right(sin_a, cos_a)), beta = named("beta", over_right(sin_b, cos_b));
    const T one_minus_beta = named("one_minus_beta", over_right(cos_b, sin_b));
    const T side = named("side", wi.x * wo.x + wi.y * wo.y);
    const T c = named("c", side / maximum(si * so, tiny<T>()));
    // 1 - |c|; 1 at the normal, where the azimuth is undefined.
    const T ui = T(1) / maximum(si, tiny<T>()), uo = select(side < T(0), T(1), T(-1)) / maximum(so, tiny<T>());
    const T apart2 = sqr(wi.x * ui + wo.x * uo) + sqr(wi.y * ui + wo.y * uo);
    const T one_minus_c = named("one_minus_abs_c", select(si * so > T(0), minimum(apart2 / T(2), T(1)), T(1)));
    // sin alpha - beta^3
    const T fall = select(cos_b < T(0.5), one_minus_beta * (T(1) + beta + beta * beta) - cos_a * cos_a / (T(1) + sin_a),
                          sin_a - beta * beta * beta);
    const T slanted = named("slanted", side * select(side < T(0), fall / maximum(sin_a, tiny<T>()), T(1)));
    const T direct =
        C1() + T(0.45) * share(0.09) * slanted / cos_b +
        T(0.125) * share(0.09) * sqr(alpha * beta) * one_minus_c * (sin_a + sin_b) / maximum(cos_a + cos_b, tiny<T>());
    // 1 - c beta^2
    const T shade = one_minus_c + abs(c) * one_minus_beta * (T(1) + beta);
    const T again = T(0.17) * share(0.13) * select(side < T(0), T(1) - c * beta * beta, shade);
    return rho * (named("direct", direct) / pi<T>()) + rho * rho * (named("again", again) / pi<T>());
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(above(wi, wo), wi, eval(wi, wo) * pi<T>(), cosine_pdf(wi));
  }

  /// Cycles' rough microfacets have the same C1 and C2, and the same shape towards the viewer. Interreflection is
  /// nearly Lambertian.
  ClosureSum<T> base(const Vec3<T>&) const {
    const T ratio = T(0.45) * share(0.09) / C1();
    const Rgb<T> again = rho * rho * (form == Full ? T(0.17) * share(0.13) : T(0));
    return {rough_facets(rho * C1(), ratio), Closure<T>(ClosureKind::Diffuse, again)};
  }

  /// Lambert's part. In the full form the term with C2 takes light off where the light comes from the other side: the
  /// most for light as high as the viewer, sin alpha being 1 at most, and beta the viewer's polar angle.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    if (form == Qualitative) return {Closure<T>(ClosureKind::Diffuse, rho * C1())};
    const T so = named("so", sqrt(sin2_theta(wo))), co = maximum(wo.z, tiny<T>());
    const T beta = T(4) / pi<T>() * atan(so / (T(1) + co)), rest = T(4) / pi<T>() * atan(co / (T(1) + so));
    const T most = rest * (T(1) + beta + beta * beta) * (so / co);
    const T direct = maximum(C1() - T(0.45) * share(0.09) * most, T(0));
    const T again = T(0.17) * share(0.13) * (rest * (T(1) + beta));
    return {Closure<T>(ClosureKind::Diffuse, rho * direct + rho * rho * again)};
  }
};

BRDFC_MODEL(OrenNayar)
BRDFC_UNDER(OrenNayar)

}  // namespace brdfc
