// SPDX-License-Identifier: GPL-3.0-or-later
// Frosted glass: a rough boundary between two transparent media, whose facets reflect and refract.
//
// B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007. With
// n the index on the far side of the viewer over that on his own, F Fresnel's reflectance of a facet,
//   f = F D G / (4 |n.i| |n.o|),                                        h = (i + o) / |i + o|, eqs. 20 and 13,
//   f = n^2 |i.h| |o.h| (1 - F) D G / (|n.i| |n.o| |o + n i|^2),        h = -(o + n i) / |o + n i|, eqs. 21 and 16,
// with h turned to the side of the surface's normal, and 0 unless o and i are on the sides of the facet that they are
// of the surface (eqs. 23, 24 and 34, chi+). Eq. 21 carries n_o^2, because it follows radiance from the light; here f
// counts energy (model/model.h), and n^2 is that of the light's side. Distributions, Smith's masking and sampling:
// model/facets.h. The paper's masking is smith_separable (eq. 23); smith_correlated has the heights of the two sides
// correlated also for refraction, as Cycles has.
//
// Cycles' Glass BSDF has the same formulas with smith_correlated, but evaluates eq. 21 without the condition on the
// sides of the facet: docs/cycles.md. So no closure equals the model.
//
// Numerical stability. With s = o.h and g = n |i.h| = sqrt(n^2 - 1 + s^2), |o + n i| is |s - g| = |1 - n^2| / (s + g),
// and the refracted direction is i = (h (1 - n^2) / (s + g) - o) / n: without cancellation however near n is to 1. h
// itself becomes uncertain there, and has no meaning at n = 1. An index within 0.001 of 1 counts as 0.001 away, which
// reflects 2.5e-7 from above and bends light by less than 0.06 degrees up to 45 degrees.
//
// Sampling. A facet that is seen, then reflection with the probability F.
#include "model/facets.h"
#include "model/fresnel.h"

namespace brdfc {

template <class T> struct RoughGlass {
  T alpha, index;
  Choice distribution, masking;
  Rgb<T> refracted, reflected;

  enum { Ggx, Beckmann };
  enum { SmithCorrelated, SmithSeparable };

  static ModelInfo info() {
    return {.name = "rough_glass",
            .label = "Rough Glass",
            .look = Look::Glass,
            .paper =
                "B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, "
                "EGSR 2007",
            .equations = "eqs. 20, 21, 13, 16; D and G of eqs. 23, 25 to 27, 33, 34",
            .doc = "Frosted glass: a rough surface that reflects and refracts.",
            .properties = {.positive = false, .smooth = false, .exact_sampling = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(alpha,
      NumberSpec{"alpha", "Roughness", 0.1, 1e-3, 1, 0.02, 1, "alpha: the square of the Roughness of Blender's nodes"}
          .by_factors());
    v(index, NumberSpec{"ior", "IOR", 1.5, 0.1, 10, 1, 2.5,
                        "Refractive index inside over the one outside. Within 0.001 of 1 it counts as 0.001 away"}
                 .as(Optical::Index));
    v(distribution, ChoiceSpec{"distribution",
                               "Distribution",
                               {"ggx", "beckmann"},
                               "ggx: most light nearly straight on, and a wide glow; beckmann: Gaussian slopes"});
    v(masking, ChoiceSpec{"masking",
                          "Masking",
                          {"smith_correlated", "smith_separable"},
                          "Facets that hide others. smith_correlated: as Blender's Glass node; smith_separable: Walter "
                          "et al. 2007"});
    v(refracted, ColorSpec{"refracted",
                           "Refraction Tint",
                           {1, 1, 1},
                           "Share of the refracted light that is left each time it passes the surface"});
    v(reflected,
      ColorSpec{"reflected", "Reflection Tint", {1, 1, 1}, "Fraction of the reflected light that is not absorbed"});
  }

  T ior() const { return index; }
  bool scatters_through() const { return true; }

  Facets<T> surface() const { return {alpha, alpha, distribution == Beckmann, distribution == Beckmann}; }

  /// The view, turned to the upper side; n, and n - 1 without cancellation.
  struct View {
    T side;
    Vec3<T> o;
    T n, step;
  };
  View view(const Vec3<T>& wo) const {
    const T off = index - T(1), size = maximum(abs(off), T(1e-3)), step = select(off < T(0), -size, size);
    const auto outside = wo.z > T(0);
    const T side = select(outside, T(1), T(-1));
    return {side, wo * side, named("n", select(outside, T(1) + step, T(1) / (T(1) + step))),
            named("n_minus_1", select(outside, step, -step / (T(1) + step)))};
  }
  /// n^2 - 1.
  static T room(const View& v) { return v.step * (T(2) + v.step); }

  /// The share of light that facets reflect, and what takes its place for refraction: with it, f is D G / (4 |n.i|
  /// |n.o|) times the one or the other.
  static T reflecting(const T& oh, const T& sin2, const View& v) {
    return fresnel_dielectric(oh, sin2, v.n, room(v)).reflected;
  }
  static T refracting(const T& oh, const T& g, const View& v) {
    // With g = n |i.h|, |o + n i| = |n^2 - 1| / (s + g).
    return T(4) * oh * v.n * g * sqr((oh + g) / room(v)) * refracted_share(oh, g, v.n);
  }

  /// A direction of the light on either side: the facet, and what it does.
  struct Event {
    Vec3<T> i, h;  ///< i mirrored to the upper side
    T oh, factor;  ///< the share that is reflected or what takes its place; 0 where there is no such facet
    Rgb<T> tint;
  };
  Event event(const Vec3<T>& wi, const View& v) const {
    const Vec3<T> i = wi * v.side;
    const auto reflects = i.z > T(0);
    const HalfVector<T> k(i, v.o);
    const Vec3<T> across = sum_of_units(v.o, i) + i * v.step;  // o + n i
    const Vec3<T> bent = across * (select(across.z < T(0), T(-1), T(1)) / maximum(length(across), tiny<T>()));
    const T oh = dot(v.o, bent), ih = dot(i, bent);
    const auto refracts = i.z < T(0) && oh > T(0) && ih < T(0);
    // Where there is no such facet, numbers for which no derivative is infinite.
    const T s = select(refracts, oh, T(1)), g = select(refracts, -v.n * ih, T(1));
    const T mirrored = reflecting(k.oh, k.one_minus_oh * (T(1) + k.oh), v), passed = refracting(s, g, v);
    return {{i.x, i.y, abs(i.z)},
            select(reflects, k.h, bent),
            select(reflects, k.oh, s),
            named("factor", select(reflects, mirrored, select(refracts, passed, T(0)))),
            select(reflects, reflected, refracted)};
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const View v = view(wo);
    const Event e = event(wi, v);
    return e.tint * (e.factor * surface().D(e.h) * surface().smith_shape(masking == SmithCorrelated, e.i, v.o));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const View v = view(wo);
    const Event e = event(wi, v);
    return e.factor * surface().D(e.h) * surface().visible(e.h.z, e.oh, v.o);
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const View v = view(wo);
    const auto [h, left] = surface().sample_normal(v.o, u);
    const T oh = maximum(dot(v.o, h), tiny<T>());
    const Vec3<T> c = cross(v.o, h);
    const T mirrored = named("mirrored", reflecting(oh, dot(c, c), v));
    const T g = named("g_bent", sqrt(maximum(room(v) + oh * oh, T(0))));
    const auto reflects = left < mirrored;
    const Vec3<T> bent = normalize((h * (-room(v) / (oh + g)) - v.o) / v.n);
    const Vec3<T> i = select(reflects, h * (T(2) * oh) - v.o, bent), above = {i.x, i.y, abs(i.z)};
    const T seen = surface().visible(h.z, oh, v.o);
    const T density = surface().D(h) * seen * select(reflects, mirrored, refracting(oh, g, v));
    const T weight = surface().smith_shape(masking == SmithCorrelated, above, v.o) * above.z / maximum(seen, tiny<T>());
    const auto exists = (reflects && i.z > T(0)) || (!reflects && i.z < T(0));
    // A lost sample points along the surface. Elsewhere f may be that of the other event, which forms would evaluate.
    const Vec3<T> along = {T(1), T(0), T(0)};
    return sample_if(exists, select(exists, i * v.side, along), select(reflects, reflected, refracted) * weight,
                     density);
  }
};

BRDFC_MODEL(RoughGlass)

}  // namespace brdfc
