// SPDX-License-Identifier: GPL-3.0-or-later
// Suffern's glossy reflector material: the diffuse term and highlight of the Phong material, plus glossy reflection.
//
// K. Suffern: Ray Tracing from the Ground Up, 2007, chapters 15 and 25 (listing 25.4: Phong shading plus eq. 25.7).
//   f = k_d c_d / pi + k_s c_s cos^es alpha + k_r c_r (e + 1) / (2 pi) cos^e alpha / cos theta_i.
// The highlight is as in the book's listing, with c = 1 (eq. 25.2). The last term is that of glossy_reflector.cpp,
// whose rays below the surface are rotated about r.
//
// In the book the diffuse term and the highlight reflect only lamps, and the last term everything else. A BRDF can't
// distinguish light sources: here all three terms reflect everything, so lamps have two highlights unless k_s or k_r is
// 0. The book's ambient term k_a c_d is emission, not reflection, and is omitted; an emission shader added to this one
// has the same effect.
//
// Numerical stability: see power_lobe.h.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct PhongMaterial {
  T kd, ks, es, kr, e;
  Rgb<T> cd, cs, cr;

  static ModelInfo info() {
    return {.name = "phong_material",
            .label = "Phong Material",
            .look = Look::Glossy,
            .paper = "K. Suffern: Ray Tracing from the Ground Up, chapters 15 and 25, 2007",
            .equations = "eqs. 25.2, 25.7, 25.8, listing 25.4",
            .doc = "The book's material: matte, with a highlight, and a blurred mirror. Their strengths just add up.",
            .properties = {.reciprocal = false,
                           .conserving = false,
                           .smooth = false,
                           .exact_sampling = false,
                           .diffuse_limit = "ks=0 kr=0",
                           .specular_limit = "kd=0 ks=0 kr=1 e=1e7"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(kd, NumberSpec{"kd", "Diffuse", 0.4, 0, 1, 0, 1, "Share of the light that the matte term reflects, k_d"});
    v(cd, ColorSpec{"cd", "Diffuse Color", {1, 1, 0.3}, "Color of the matte term, c_d"});
    v(ks, NumberSpec{"ks", "Specular", 0.2, 0, 1, 0, 1, "Height of the highlight, k_s"});
    v(cs, ColorSpec{"cs", "Specular Color", {1, 1, 1}, "Color of the highlight, c_s"});
    v(es, NumberSpec{"es", "Specular Exponent", 25, 1, 1e7, 1, 1000, "Width of the highlight; larger is sharper"}
              .by_factors());
    v(kr, NumberSpec{"kr", "Reflection", 0.4, 0, 1, 0, 1, "Share of the light that is reflected, k_r"});
    v(cr, ColorSpec{"cr", "Reflection Color", {1, 1, 0.3}, "Color of the reflection, c_r"});
    v(e, NumberSpec{"e", "Reflection Exponent", 100, 1, 1e7, 1, 100000, "Blur of the reflection; larger is sharper"}
             .by_factors());
  }

  /// (e + 1) / (2 pi) cos^e alpha, doubled where the direction rotated about r is below the surface.
  T reflection_pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const Vec3<T> r = reflect(wo);
    const T partner_z = named("partner_z", T(2) * dot(r, wi) * r.z - wi.z);
    return power_lobe_pdf(e, r, wi) * select(partner_z <= T(0), T(2), T(1));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const Rgb<T> f = cd * (kd / pi<T>()) + cs * (ks * power_lobe(es, reflect(wo), wi)) +
                     cr * (kr * reflection_pdf(wi, wo) / maximum(wi.z, tiny<T>()));
    return select(above(wi, wo), f, Rgb<T>(T(0)));
  }

  /// The probabilities of the lobes, in proportion to the largest albedo of each; that of the diffuse term is `matte`,
  /// and of the reflection the part `reflected` is counted.
  struct Shares {
    T specular, reflection;
  };
  Shares shares(const T& matte, const T& reflected) const {
    const T s = ks * max_component(cs) * (T(2) * pi<T>() / (es + T(1))), r = kr * max_component(cr) * reflected;
    const T all = maximum(matte + s + r, tiny<T>());
    return {named("specular_share", s / all), named("reflection_share", r / all)};
  }
  Shares shares() const { return shares(kd * max_component(cd), T(1)); }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return pdf(wi, wo, shares()); }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo, const Shares& p) const {
    const T matte = maximum(T(1) - p.specular - p.reflection, T(0));
    return select(above(wi, wo),
                  matte * cosine_pdf(wi) + p.specular * power_lobe_pdf(es, reflect(wo), wi) +
                      p.reflection * reflection_pdf(wi, wo),
                  T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const { return sample(wo, u, shares()); }
  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u, const Shares& p) const {
    const auto reflects = u.x < p.reflection;
    const Vec3<T> r = reflect(wo), s = sample_power_lobe(select(reflects, e, es), u.y, u.z);
    const Vec3<T> lobe = about_axis(r, s), turned = about_axis(r, {-s.x, -s.y, s.z});
    const Vec3<T> glossy = select(reflects && lobe.z <= T(0), turned, lobe);
    const Vec3<T> wi = select(u.x < p.reflection + p.specular, glossy, sample_cosine(u.y, u.z));
    const T density = pdf(wi, wo, p);
    return sample_if(density > T(0), wi, eval(wi, wo) * (wi.z / maximum(density, tiny<T>())), density);
  }

  /// The first two terms exactly, and the lobe of the third as in glossy_reflector.cpp.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    return {Closure<T>(ClosureKind::Diffuse, cd * kd), power_closure(cs * (ks * T(2) * pi<T>() / (es + T(2))), es),
            power_closure(cr * (kr * (e + T(1)) / ((e + T(2)) * lobe_height(wo.z, T(0.25) / (e + T(2))))), e)};
  }

  /// The diffuse term, exactly, and a part of the reflection.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    return {Closure<T>(ClosureKind::Diffuse, cd * kd), power_facets_under(cr * kr, e, wo)};
  }
  /// Where these are taken, the highlight and what is left of the reflection are drawn.
  Sample<T> sample_beside_under(const Vec3<T>& wo, const Vec3<T>& u, const T& stands) const {
    return sample(wo, u, shares(kd * max_component(cd) * (T(1) - stands), T(1 - kPowerUnder)));
  }
};

BRDFC_MODEL(PhongMaterial)
BRDFC_UNDER(PhongMaterial)

}  // namespace brdfc
