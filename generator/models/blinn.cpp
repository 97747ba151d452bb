// SPDX-License-Identifier: GPL-3.0-or-later
// Blinn's microfacet model: V-shaped cavities with a cosine-power distribution of normals.
//
// J. Blinn: Models of Light Reflection for Computer Synthesized Pictures, SIGGRAPH 1977.
// f = F D G / (4 (n.i)(n.o)), D = (e + 2) / (2 pi) (n.h)^e, G = min(1, 2 (n.h)(n.i) / (o.h), 2 (n.h)(n.o) / (o.h)).
//
// The paper leaves the normalisation of D open (its D is 1 at h = n) and includes all constants in k_s. Here D (n.h)
// integrates to 1, and the factor 1/4 is the Jacobian of reflection. So k_s = F is a reflectance, and with k_s = 1 the
// only loss is the light that the cavities block.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/under.h"
#include "model/v_cavity.h"

namespace brdfc {

template <class T> struct Blinn {
  Rgb<T> ks;
  T e;

  static ModelInfo info() {
    return {.name = "blinn",
            .label = "Blinn",
            .look = Look::Metal,
            .paper = "J. Blinn: Models of Light Reflection for Computer Synthesized Pictures, SIGGRAPH 1977",
            .equations = "f = k_s D G / (4 (n.i)(n.o)), D = (e + 2) / (2 pi) (n.h)^e",
            .doc = "Microfacets in V-shaped cavities with a cosine-power distribution of normals.",
            .properties = {.smooth = false,  // min() in the geometry term
                           .exact_sampling = false,
                           .specular_limit = "e=1e8",
                           .fit_axis = "e"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(ks, ColorSpec{"ks", "Specular", {0.5, 0.5, 0.5}, "Reflectance of a facet, k_s"}.as(Optical::Reflectance));
    v(e, NumberSpec{"e", "Exponent", 50, 0, 1e8, 0, 1000, "Exponent of the facets' distribution: larger is smoother"}
             .by_factors());
  }

  T D(const Vec3<T>& h) const { return named("D", (e + T(2)) / (T(2) * pi<T>()) * polar_power(e, h)); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return ks * select(above(wi, wo), D(k.h) / T(4) * v_cavity_shape(k, wi, wo), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return select(above(wi, wo), v_cavity_pdf(k, D(k.h)), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> h = sample_power_lobe(e + T(1), u.y, u.z);
    const T oh = named("oh", dot(wo, h));
    const Vec3<T> wi = h * (T(2) * oh) - wo;
    return sample_if(above(wi, wo), wi, ks * v_cavity_weight(h, oh, wi, wo), pdf(wi, wo));
  }

  /// Gaussian slopes with the width and height of the cosine power. Wide lobes, which lose light below the horizon, get
  /// a smaller width.
  ClosureSum<T> base(const Vec3<T>&) const {
    const T scale = T(1) / (e + T(3));
    return {facets(ClosureKind::Beckmann, ks * ((e + T(2)) * scale), sqrt(T(2) * scale))};
  }

  /// As in cook_torrance.cpp. (n.h)^e over Beckmann's distribution with the same peak is above exp(-tan^2 theta_h).
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T alpha = sqrt(T(2) / (e + T(2))), narrow = sqr(alpha) + narrow_towards_horizon(alpha, wo);
    return {narrower_facets(ks, alpha, alpha, narrow, narrow)};
  }

  /// Visible microfacets.
  Sample<T> sample_beside_under(const Vec3<T>& wo, const Vec3<T>& u, const T&) const {
    const Vec3<T> h = visible_side(sample_power_lobe(e + T(1), u.y, u.z), wo, u.x);
    const T oh = named("oh", dot(wo, h));
    const Vec3<T> wi = h * (T(2) * oh) - wo;
    const HalfVector<T> k(wi, wo);
    return sample_if(above(wi, wo), wi, ks * visible_side_weight(h, oh, wi, wo),
                     select(above(wi, wo), visible_side_pdf(k, D(k.h), wo), T(0)));
  }
};

BRDFC_MODEL(Blinn)
BRDFC_UNDER(Blinn)

}  // namespace brdfc
