// SPDX-License-Identifier: GPL-3.0-or-later
// Neumann's Phong lobe, "pumped up" by dividing by the larger of both cosines, also called the stretched Phong model;
// the predecessor of Ashikhmin and Shirley's.
//
// L. Neumann, A. Neumann, L. Szirmay-Kalos: Compact Metallic Reflectance Models, Computer Graphics Forum 18(3), 1999;
// quoted as eq. 2 by Ashikhmin and Shirley. f = k_s c cos^e alpha / max(cos theta_i, cos theta_o), where alpha is the
// angle between the light and the mirrored view direction.
//
// c = (e + 1) / (2 pi): then f cos theta_i is at most a pdf, so that the albedo is below k_s and approaches it at every
// angle for e -> infinity. The paper's Fresnel term is the constant k_s here.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct MaxPhong {
  Rgb<T> ks;
  T e;

  static ModelInfo info() {
    return {.name = "max_phong",
            .label = "Max-Phong",
            .look = Look::Metal,
            .paper =
                "L. Neumann, A. Neumann, L. Szirmay-Kalos: Compact Metallic Reflectance Models, Computer Graphics "
                "Forum 18(3), 1999",
            .equations = "f = k_s (e + 1) / (2 pi) cos^e alpha / max(cos theta_i, cos theta_o)",
            .doc = "Metallic Phong lobe whose highlight is as bright at grazing angles as from above.",
            .properties = {.positive = false,  // black beyond 90 degrees from the mirror direction
                           .smooth = false,    // max(): an edge where both cosines are equal
                           .exact_sampling = false,
                           .specular_limit = "e=1e8",
                           .fit_axis = "e"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(ks, ColorSpec{"ks", "Specular", {0.5, 0.5, 0.5}, "Reflectance of the mirror it tends to, k_s"}.as(
              Optical::Reflectance));
    v(e, NumberSpec{"e", "Exponent", 20, 0, 1e8, 1, 1000, "Phong exponent: larger is narrower"}.by_factors());
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return ks *
           select(above(wi, wo), power_lobe_pdf(e, wi, reflect(wo)) / maximum(maximum(wi.z, wo.z), tiny<T>()), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), power_lobe_pdf(e, wi, reflect(wo)), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = about_axis(reflect(wo), sample_power_lobe(e, u.y, u.z));
    const T ratio = wi.z / maximum(maximum(wi.z, wo.z), tiny<T>());
    return sample_if(above(wi, wo), wi, ks * ratio, pdf(wi, wo));
  }

  /// Approximates cos theta_i / max(cos theta_i, cos theta_o) by a constant plus a multiple of cos theta_i / cos
  /// theta_o. The coefficients depend on how much the cosine varies over the lobe: at normal incidence cos theta_i is
  /// always the smaller one, near the horizon hardly ever.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T width = T(1) / sqrt(e + T(2)), z = maximum(wo.z, T(1e-3));
    const T slope = named("slope", sqrt(sin2_theta(wo)) / z * width), slope2 = slope * slope;
    const T smaller = named("smaller", sqr(clamp01(T(1.3) * width * width / maximum(slope, tiny<T>()))));
    const T sloped = T(0.65) / (T(1) + T(2.5) * slope2), level = T(1) - sloped - T(0.6) * slope / sqr(T(1) + slope2);
    const Rgb<T> all = ks * share_of_wide(e);
    ClosureSum<T> sum = power_cones(all * (level * (T(1) - smaller) * (e + T(1)) / (T(2) * pi<T>())), e);
    sum.push_back(power_closure(all * ((sloped + (T(1) - sloped) * smaller) * (e + T(1)) / (e + T(2)) / z), e));
    return sum;
  }
};

BRDFC_MODEL(MaxPhong)

}  // namespace brdfc
