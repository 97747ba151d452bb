// SPDX-License-Identifier: GPL-3.0-or-later
// Lambert's diffuse reflector: f = rho / pi.
//
// J. H. Lambert: Photometria, 1760. Cycles' diffuse closure is this model.
#include "model/sampling.h"

namespace brdfc {

template <class T> struct Lambert {
  Rgb<T> rho;

  static ModelInfo info() {
    return {.name = "lambert",
            .label = "Lambert",
            .look = Look::Matte,
            .paper = "J. H. Lambert: Photometria, 1760",
            .equations = "f = rho / pi",
            .doc = "Ideal diffuse reflection: the same radiance in every direction.",
            .properties = {.lossless = true, .diffuse_limit = "rho=0.8"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.8, 0.8, 0.8}, "Share of the light that is reflected"});
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), rho / pi<T>(), Rgb<T>(T(0))); }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(wo.z > T(0) && wi.z > T(0), wi, rho, cosine_pdf(wi));
  }

  ClosureSum<T> exact(const Vec3<T>&) const { return {Closure<T>(ClosureKind::Diffuse, rho)}; }
};

BRDFC_MODEL(Lambert)

}  // namespace brdfc
