// SPDX-License-Identifier: GPL-3.0-or-later
// Disney's diffuse term: a matte surface whose rim is darker than Lambert's if it is smooth, brighter if it is rough.
//
// B. Burley: Physically Based Shading at Disney, SIGGRAPH 2012 course, section 5.3:
//   f = rho / pi (1 + (F_D90 - 1) s_i) (1 + (F_D90 - 1) s_o),  F_D90 = 1/2 + 2 r cos^2 theta_d,
//   s = (1 - cos theta)^5, where theta_d is the angle between the half vector and either direction.
// It is fitted to measured materials of the MERL database: shadows at grazing angles for smooth ones, retroreflection
// for rough ones. It does not conserve energy: the albedo of rho = 1 at the horizon is 0.49 for r = 0, 1.01 for r = 1/2
// and 1.56 for r = 1; seen from above it is 0.98, 1.01 and 1.04. Sheen and the term for subsurface scattering are parts
// of the same paper's material, and are not in this model.
//
// With k = 1 - F_D90 = 1/2 - r (1 + wi.wo) both factors are 1 - k s, and no half vector is needed. This is the formula
// of Cycles' burley_diffuse_bsdf, so the exact form is that closure.
//
// Sampling is Lambert's: f varies little where the cosine is not small. The variance of samples is at most 0.15 of the
// squared albedo, for r = 1 seen from the horizon, and below 0.01 from above.
//
// Under the model is Lambert's law. The largest k is that of a light opposite to the viewer at the horizon, K = 1/2 - r
// (1 - sin theta_o), so f >= rho / pi (1 - K) (1 - K s_o). Only close to the horizon is f as small as that. With
// K^(2/3) / 8 more in place of the first factor, what is too bright is at most 5e-5 of the light.
#include "model/burley.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct DisneyDiffuse {
  Rgb<T> rho;
  T r;

  static ModelInfo info() {
    return {.name = "disney_diffuse",
            .label = "Disney Diffuse",
            .look = Look::Matte,
            .paper = "B. Burley: Physically Based Shading at Disney, SIGGRAPH 2012 course",
            .equations = "f_d of section 5.3",
            .doc = "Matte surface with a dark rim if it is smooth and a bright one if it is rough.",
            .properties = {.conserving = false, .exact_sampling = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Base Color", {0.8, 0.8, 0.8}, "Reflectance seen and lit from above"});
    v(r, NumberSpec{"r", "Roughness", 0.5, 0, 1, 0, 1, "0 darkens the rim, 1 brightens it towards the lamp"});
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T pair = burley_diffuse(r, wi, wo);
    return select(above(wi, wo), rho * (pair / pi<T>()), Rgb<T>(T(0)));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return select(above(wi, wo), cosine_pdf(wi), T(0)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_cosine(u.y, u.z);
    return sample_if(above(wi, wo), wi, eval(wi, wo) * pi<T>(), pdf(wi, wo));
  }

  ClosureSum<T> exact(const Vec3<T>&) const {
    Closure<T> burley(ClosureKind::Burley, rho);
    burley.roughness = r;
    return {burley};
  }

  ClosureSum<T> under(const Vec3<T>& wo) const {
    return {Closure<T>(ClosureKind::Diffuse, rho * least_burley_diffuse(r, wo))};
  }
};

BRDFC_MODEL(DisneyDiffuse)
BRDFC_UNDER(DisneyDiffuse)

}  // namespace brdfc
