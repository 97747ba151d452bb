// SPDX-License-Identifier: GPL-3.0-or-later
// Cook and Torrance's microfacet model: V-shaped cavities with Beckmann's distribution of slopes.
//
// R. Cook, K. Torrance: A Reflectance Model for Computer Graphics, ACM Transactions on Graphics 1(1), 1982.
// f = F D G / (4 (n.i)(n.o)), D = exp(-tan^2 theta_h / m^2) / (pi m^2 (n.h)^4),
// G = min(1, 2 (n.h)(n.i) / (o.h), 2 (n.h)(n.o) / (o.h)).
//
// Erratum: the paper divides by pi (n.i)(n.o), and its D lacks the pi; together that reflects four times too much light
// (D (n.h) must integrate to 1, and the Jacobian of reflection is 1/4).
//
// F is Schlick's approximation with the reflectance f0 at normal incidence. The paper instead solves f0 for a
// refractive index and uses the Fresnel equations. Schlick's F is linear in f0, as the tables of the albedo require.
#include "model/base_terms.h"
#include "model/fresnel.h"
#include "model/under.h"
#include "model/v_cavity.h"

namespace brdfc {

template <class T> struct CookTorrance {
  Rgb<T> f0;
  T m;

  static ModelInfo info() {
    return {.name = "cook_torrance",
            .label = "Cook-Torrance",
            .look = Look::Metal,
            .paper =
                "R. Cook, K. Torrance: A Reflectance Model for Computer Graphics, ACM Transactions on Graphics 1(1), "
                "1982",
            .equations = "f = F D G / (4 (n.i)(n.o)), Beckmann's D; pi for 4 mended; Schlick's F",
            .doc = "Microfacets in V-shaped cavities with Beckmann's distribution of slopes and Fresnel reflection.",
            .properties = {.smooth = false,  // min() in the geometry term
                           .exact_sampling = false,
                           .specular_limit = "m=1e-4",
                           .fit_axis = "m"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(f0, ColorSpec{"f0", "Normal Reflectance", {0.9, 0.6, 0.3}, "Reflectance of a facet seen from above"}.as(
              Optical::Reflectance));
    v(m, NumberSpec{"m", "Slope", 0.3, 1e-4, 1, 0.05, 1, "Root mean square slope of the facets, m"}.by_factors());
  }

  T D(const Vec3<T>& h) const {
    const Slopes<T> s(h);
    const T m2 = m * m;
    return named("D", exp(-(s.x * s.x + s.y * s.y) / m2) * sqr(s.inverse_cos2()) / (pi<T>() * m2));
  }

  Rgb<T> F(const T& one_minus_oh) const { return named("F", schlick_fresnel(f0, one_minus_oh)); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return F(k.one_minus_oh) * select(above(wi, wo), D(k.h) / T(4) * v_cavity_shape(k, wi, wo), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return select(above(wi, wo), v_cavity_pdf(k, D(k.h)), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> h = sample_gaussian_slopes(m, m, u.y, u.z);
    const T oh = named("oh", dot(wo, h));
    const Vec3<T> wi = h * (T(2) * oh) - wo;
    return sample_if(above(wi, wo), wi, F(clamp01(T(1) - oh)) * v_cavity_weight(h, oh, wi, wo), pdf(wi, wo));
  }

  /// The same microfacets with another geometry term, and the Fresnel term at the middle of the lobe.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T height = lobe_height(wo.z, T(0.7) * m * m * sin2_theta(wo));
    return {facets(ClosureKind::Beckmann, F(clamp01(T(1) - height)), m)};
  }

  /// With the reflectance at normal incidence. V-shaped cavities mask nothing about the mirror direction.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T narrow = narrow_towards_horizon(m, wo);
    return {narrower_facets(f0, m, m, narrow, narrow)};
  }

  /// Visible microfacets.
  Sample<T> sample_beside_under(const Vec3<T>& wo, const Vec3<T>& u, const T&) const {
    const Vec3<T> h = visible_side(sample_gaussian_slopes(m, m, u.y, u.z), wo, u.x);
    const T oh = named("oh", dot(wo, h));
    const Vec3<T> wi = h * (T(2) * oh) - wo;
    const HalfVector<T> k(wi, wo);
    return sample_if(above(wi, wo), wi, F(clamp01(T(1) - oh)) * visible_side_weight(h, oh, wi, wo),
                     select(above(wi, wo), visible_side_pdf(k, D(k.h), wo), T(0)));
  }
};

BRDFC_MODEL(CookTorrance)
BRDFC_UNDER(CookTorrance)

}  // namespace brdfc
