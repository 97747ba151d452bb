// SPDX-License-Identifier: GPL-3.0-or-later
// Suffern's glossy reflector: a blurred mirror that samples rays about the mirror direction, all with the same weight.
//
// K. Suffern: Ray Tracing from the Ground Up, 2007, chapter 25. Equation numbers are those of the book.
// The estimator eq. 25.7 averages over directions with the pdf (e + 1) / (2 pi) cos^e alpha about r (eqs. 25.1, 25.8).
// It estimates the integral of f cos theta_i = k_r c_r (e + 1) / (2 pi) cos^e alpha. The cosine of eq. 25.3 is missing,
// because eq. 25.6 divides by it. So f is not reciprocal and is unbounded towards the horizon.
//
// Rays below the surface: "lose" drops them (fig. 25.5: half as bright at the silhouette); "mirror" rotates them about
// r by 180 degrees, which puts them above it (figs. 25.6, 25.7). The pdf is then twice as large where the rotated
// direction, 2 (r.wi) r - wi, is below the surface, and is discontinuous there. No ray is lost, so the albedo is k_r
// c_r at every angle.
//
// Numerical stability: see power_lobe.h.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct GlossyReflector {
  T kr, e;
  Rgb<T> cr;
  Choice below;

  enum { Mirror, Lose };

  static ModelInfo info() {
    return {.name = "glossy_reflector",
            .label = "Glossy Reflector",
            .look = Look::Glossy,
            .paper = "K. Suffern: Ray Tracing from the Ground Up, chapter 25, 2007",
            .equations = "eqs. 25.1, 25.7, 25.8",
            .doc = "Blurred mirror: rays spread about the mirror direction, all of the same weight.",
            .properties =
                {.reciprocal = false, .positive = false, .smooth = false, .specular_limit = "e=1e7", .fit_axis = "e"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(kr, NumberSpec{"kr", "Reflection", 0.9, 0, 1, 0, 1, "Share of the light that is reflected, k_r"});
    v(cr, ColorSpec{"cr", "Reflection Color", {1, 1, 1}, "Color of the reflection, c_r"}.as(Optical::Tint));
    v(e, NumberSpec{"e", "Exponent", 100, 1, 1e7, 1, 100000, "1 is matte about the mirror direction; larger sharper"}
             .by_factors());
    v(below, ChoiceSpec{"below",
                        "Rays Below",
                        {"mirror", "lose"},
                        "What becomes of rays below the surface. mirror: turned about the mirror direction; lose: "
                        "dropped, as in the book's incorrect picture"});
  }

  /// The pdf of sample(); it is also f cos theta_i divided by k_r c_r.
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const Vec3<T> r = reflect(wo);
    const T p = power_lobe_pdf(e, r, wi);
    if (below == Lose) return select(above(wi, wo), p, T(0));
    const T partner_z = named("partner_z", T(2) * dot(r, wi) * r.z - wi.z);
    return select(above(wi, wo), p * select(partner_z <= T(0), T(2), T(1)), T(0));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return cr * (kr * pdf(wi, wo) / maximum(wi.z, tiny<T>())); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> r = reflect(wo), s = sample_power_lobe(e, u.y, u.z);
    Vec3<T> wi = about_axis(r, s);
    if (below == Mirror) {
      const Vec3<T> turned = about_axis(r, {-s.x, -s.y, s.z});
      const auto flip = wi.z <= T(0);
      wi = select(flip, turned, wi);
    }
    return sample_if(above(wi, wo), wi, cr * kr, pdf(wi, wo));
  }

  ClosureSum<T> base(const Vec3<T>&) const {
    return power_cones(cr * (kr * share_of_wide(e) * (e + T(1)) / (T(2) * pi<T>())), e);
  }
  ClosureSum<T> under(const Vec3<T>& wo) const { return {power_facets_under(cr * kr, e, wo)}; }
};

BRDFC_MODEL(GlossyReflector)
BRDFC_UNDER(GlossyReflector)

}  // namespace brdfc
