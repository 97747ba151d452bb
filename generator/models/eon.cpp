// SPDX-License-Identifier: GPL-3.0-or-later
// The energy-preserving Oren-Nayar model: rough matte facets, and all light that they send to one another.
//
// J. Portsmouth, P. Kutz, S. Hill: EON: A Practical Energy-Preserving Rough Diffuse BRDF, JCGT 14(1), 2025. With
// s = wi.wo - (n.i)(n.o), and t the larger cosine for s > 0 and 1 otherwise, after Y. Fujii's form of Oren and Nayar's
// model:
//   f = rho / pi (A + B s / t) + rho_ms / pi (1 - E_i) (1 - E_o) / (1 - mean E),
//   A = 1 / (1 + (1/2 - 2 / (3 pi)) r),  B = r A,  mean E = A (1 + (2/3 - 28 / (15 pi)) r),
//   rho_ms = rho^2 mean E / (1 - rho (1 - mean E)),
//   E(c) = A + B / pi [S (theta - S c) + 2/3 (S / c (1 - S^3) - S)],  S = sin theta, the albedo of white facets.
// So the albedo is rho E_o + rho_ms (1 - E_o), and no light is lost with rho = 1. The paper also approximates E by a
// polynomial, off by up to 1e-3; that loses or gains as much, and Cycles' closure has the E above.
//
// The formula is that of Cycles' Diffuse BSDF with a roughness, except that Cycles multiplies the interreflection by
// the colour once more: closures/closure.h has both, in a form that keeps its precision near the horizon, where S / c
// is unbounded and 1 - E vanishes. Opposite to the light, with r = 1 and both directions near the horizon, 1 + s would
// cancel; it is half the sum of squares of (i + o)'s components along the surface and of both cosines.
//
// Sampling. The paper samples linearly transformed cosines, clipped, mixed with a uniform density. Here it is Lambert's
// cosine mixed with a uniform density, whose share is within 0.03 of the one with the least variance; the variance is
// 0.21 for r = 1 seen at 60 degrees, and 0.45 at the horizon. The exact form needs no sampling of its own.
#include "model/base_terms.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Eon {
  Rgb<T> rho;
  T r;

  static ModelInfo info() {
    return {.name = "eon",
            .label = "EON Rough Diffuse",
            .look = Look::Matte,
            .paper =
                "J. Portsmouth, P. Kutz, S. Hill: EON: A Practical Energy-Preserving Rough Diffuse BRDF, JCGT "
                "14(1), 2025",
            .equations = "f = f_ss + f_ms with the exact albedo of Fujii's facets, listing 1",
            .doc = "Rough matte surface that loses no light: Oren and Nayar's facets with all interreflection.",
            .properties = {.lossless = true,
                           .smooth = false,  // kinks where s changes its sign and where the angles are equal
                           .exact_sampling = false,
                           .diffuse_limit = "r=0",
                           .albedo_table = false,  // not a polynomial in the colour
                           .fit_axis = "r"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.8, 0.8, 0.8}, "Albedo of the facets; white ones lose no light"});
    v(r, NumberSpec{"r", "Roughness", 0.5, 0, 1, 0, 1, "0 is Lambert's law; the Roughness of Blender's Diffuse BSDF"});
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T s = named("s", wi.x * wo.x + wi.y * wo.y);
    const RoughMatte<T> facets(r, maximum(wi.z, T(0)), maximum(wo.z, T(0)), s);
    const T rise = (sqr(wi.x + wo.x) + sqr(wi.y + wo.y) + sqr(wi.z) + sqr(wo.z)) / T(2);  // 1 + s
    const T away = facets.level * ((T(1) - r) + r * rise);
    const Rgb<T> f = rho * named("once", select(s > T(0), facets.once, away)) + facets.interreflection(rho);
    return select(above(wi, wo), f, Rgb<T>(T(0)));
  }

  /// The share of the uniform density.
  T level(const Vec3<T>& wo) const {
    const T rest = maximum(T(1) - wo.z, T(0));
    return named("level", maximum(T(0.6) * r * rest * rest * rest, tiny<T>()));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), everywhere_pdf(wi, level(wo)), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_everywhere(u.y, u.z, level(wo));
    const T density = pdf(wi, wo);
    return sample_if(above(wi, wo), wi, eval(wi, wo) * (wi.z / maximum(density, tiny<T>())), density);
  }

  ClosureSum<T> exact(const Vec3<T>&) const { return {lossless_rough_facets(rho, r)}; }

  /// All single reflection, and interreflection with the colour that it has in Cycles.
  ClosureSum<T> under(const Vec3<T>&) const {
    Closure<T> facets(ClosureKind::OrenNayar, Rgb<T>(T(1)));
    facets.roughness = r;
    facets.albedo = rho;
    return {facets};
  }
};

BRDFC_MODEL(Eon)
BRDFC_UNDER(Eon)

}  // namespace brdfc
