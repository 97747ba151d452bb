// SPDX-License-Identifier: GPL-3.0-or-later
// Phong's highlight as it was published: a shading formula, interpreted as a BRDF.
//
// B. T. Phong: Illumination for Computer Generated Pictures, Communications of the ACM 18(6), 1975.
// The reflected radiance is k_s cos^e alpha times the irradiance on a plane that faces the light, where alpha is the
// angle between the light and the mirrored view direction. The rendering equation's cosine is missing, so
// f = k_s cos^e alpha / cos theta_i.
//
// Therefore f is not reciprocal. k_s is independent of e: at normal incidence the albedo is 2 pi k_s / (e + 1), which
// is a gain below e = 5.28 and almost 0 for large e. The part of the lobe below the horizon is lost.
//
// Numerical stability: see power_lobe.h.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct Phong {
  Rgb<T> ks;
  T e;

  static ModelInfo info() {
    return {.name = "phong",
            .label = "Phong",
            .look = Look::Glossy,
            .paper = "B. T. Phong: Illumination for Computer Generated Pictures, Communications of the ACM 18(6), 1975",
            .equations = "f = k_s cos^e alpha / cos theta_i",
            .doc = "The original highlight around the mirror direction: neither reciprocal nor energy conserving.",
            .properties = {.reciprocal = false,
                           .conserving = false,
                           .positive = false,  // black beyond 90 degrees from the mirror direction
                           .smooth = false,    // with e <= 1 the rim of the lobe is an edge
                           .specular_limit = "e=1e8",
                           .fit_axis = "e"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(ks, ColorSpec{"ks", "Specular", {0.5, 0.5, 0.5}, "Height of the highlight, k_s"});
    v(e, NumberSpec{"e", "Exponent", 20, 0, 1e8, 1, 1000, "Phong exponent: larger is narrower, and darker as a whole"}
             .by_factors());
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return ks * select(above(wi, wo), power_lobe(e, wi, reflect(wo)) / maximum(wi.z, tiny<T>()), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), power_lobe_pdf(e, wi, reflect(wo)), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = about_axis(reflect(wo), sample_power_lobe(e, u.y, u.z));
    return sample_if(above(wi, wo), wi, ks * (T(2) * pi<T>() / (e + T(1))), pdf(wi, wo));
  }

  ClosureSum<T> base(const Vec3<T>&) const { return power_cones(ks * share_of_wide(e), e); }
};

BRDFC_MODEL(Phong)

}  // namespace brdfc
