// SPDX-License-Identifier: GPL-3.0-or-later
// The reciprocal Phong lobe, normalised so that it does not gain energy.
//
// E. Lafortune, Y. Willems: Using the Modified Phong Reflectance Model for Physically Based Rendering, Report CW 197,
// K.U. Leuven, 1994. f = k_s (e + 2) / (2 pi) cos^e alpha, where alpha is the angle between the light and the mirrored
// view direction.
//
// The albedo is k_s at normal incidence and decreases towards grazing angles, as cos theta_o for large e.
//
// Numerical stability: see power_lobe.h.
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct ModifiedPhong {
  Rgb<T> ks;
  T e;

  static ModelInfo info() {
    return {.name = "modified_phong",
            .label = "Modified Phong",
            .look = Look::Glossy,
            .paper =
                "E. Lafortune, Y. Willems: Using the Modified Phong Reflectance Model for Physically Based Rendering, "
                "Report CW 197, K.U. Leuven, 1994",
            .equations = "f = k_s (e + 2) / (2 pi) cos^e alpha",
            .doc = "Reciprocal, energy conserving Phong lobe; darkens towards grazing angles.",
            .properties = {.positive = false,  // black beyond 90 degrees from the mirror direction
                           .smooth = false,    // with e <= 1 the rim of the lobe is an edge
                           .exact_sampling = false,
                           .specular_limit = "e=1e8"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(ks, ColorSpec{"ks", "Specular", {0.5, 0.5, 0.5}, "Share of the light that is reflected, seen from above, k_s"}.as(
              Optical::Reflectance));
    v(e, NumberSpec{"e", "Exponent", 20, 0, 1e8, 1, 1000, "Phong exponent: larger is narrower"}.by_factors());
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return ks * select(above(wi, wo), (e + T(2)) / (T(2) * pi<T>()) * power_lobe(e, wi, reflect(wo)), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), power_lobe_pdf(e, wi, reflect(wo)), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = about_axis(reflect(wo), sample_power_lobe(e, u.y, u.z));
    return sample_if(above(wi, wo), wi, ks * ((e + T(2)) / (e + T(1)) * wi.z), pdf(wi, wo));
  }

  /// Cycles' ramp closure is this lobe times a ramp, which is constant here. When Cycles evaluates it for a lamp, it
  /// takes the power of a cosine rounded to float, with a relative error of about 1e-7 e; its sampling has no such
  /// error.
  ClosureSum<T> exact(const Vec3<T>&) const {
    Closure<T> lobe(ClosureKind::PhongRamp, ks);
    for (Rgb<T>& colour : lobe.ramp) colour = Rgb<T>(T(1));
    lobe.exponent = e;
    return {lobe};
  }
};

BRDFC_MODEL(ModifiedPhong)

}  // namespace brdfc
