// SPDX-License-Identifier: GPL-3.0-or-later
// Microfacets composed of a distribution of normals, a masking function and a Fresnel term.
//
// B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007:
// f = F D G / (4 (n.i)(n.o)), eq. 20. Distributions, Smith's masking and the sampling of both: model/facets.h. The
// masking v_cavity is Torrance and Sparrow's, of model/v_cavity.h.
//
// F is Schlick's approximation S with the reflectance f0, times a tint that is strongest at 82 degrees, where the
// cosine is 1/7: P. Kutz, M. Hasan, D. Edmondson: Novel Aspects of the Adobe Standard Material, 2021. Their
//   F = S(c) - (1 - tint) S(1/7) q(c),  q = c (1 - c)^6 / ((1/7) (6/7)^6)
// is negative for dark colours. Here the same q is a factor, F = S(c) (1 - (1 - tint) q(c)), which is the same at 0, 82
// and 90 degrees, never negative, and linear in either colour, as tables of the albedo require. With a white tint both
// are Schlick's F. For f0 above 0.5 and tints above 0.7 the two differ by less than 0.03, for f0 above 0.9 by 0.006.
//
// multiscatter_ggx adds the light that facets of ggx with smith_correlated reflect more than once, after E. Turquin:
// Practical multiple scattering compensation for microfacet models, 2019: f is multiplied by
//   1 + again (1 - E(o)) / E(o),
// where E is the albedo of facets that reflect everything. With f0, tint and again at 1 no light is lost. As in Cycles,
// which has again = F E_mean / (1 - F (1 - E_mean)) with means F and E_mean of the Fresnel term and of E, the factor
// depends on the viewer alone, so that f is not reciprocal; and with two roughnesses E is that of the roughness
// alpha = sqrt(ax ay), so that f may gain light. E has no closed form. With m = (n.o) / ((n.o) + alpha), here
//   1 - E = m^(3/4) (1 - m) sum_ij c_ij (2 sqrt(m) - 1)^i (2 alpha - 1)^j,
// fitted to quadratures of the largest relative error of E, which is 8e-4.
//
// Numerical stability. With s = 7 (1 - c) / 6, q is 7 c s^6 and 1 - q is (1 - s)^2 (1 + 2 s + ... + 6 s^5).
#include "model/base_terms.h"
#include "model/facets.h"
#include "model/fresnel.h"
#include "model/under.h"
#include "model/v_cavity.h"

namespace brdfc {
namespace {

/// c_ij of 1 - E.
constexpr std::array<std::array<double, 9>, 9> kLost = {
    {{0.71753, 0.87757, 0.27211, -0.14623, 0.01419, 0.04226, -0.03416, -0.01468, 0.01455},
     {0.46063, 0.27899, 0.09673, -0.03409, -0.12826, -0.03108, 0.06197, -0.01006},
     {0.41162, 0.54141, 0.05548, -0.00918, 0.06144, -0.1257, 0.09608},
     {0.54289, 0.90128, 0.20428, -0.8006, -0.29042, 0.30556},
     {0.60854, 0.77858, 0.93307, -0.06118, -0.95463},
     {-1.06112, 0.89166, 1.35493, 0.16223},
     {-1.9358, 1.12287, 1.29002},
     {1.18473, 0.903},
     {1.65487}}};

}  // namespace

template <class T> struct Microfacet {
  Rgb<T> f0, tint, again;
  T ax, ay;
  Choice distribution, masking;

  enum { Ggx, Beckmann, MultiscatterGgx };
  enum { SmithCorrelated, SmithSeparable, VCavity };
  static constexpr double kGrey = 1e-5;  // of channels that are equal but for rounding

  static ModelInfo info() {
    return {.name = "microfacet",
            .label = "Microfacet",
            .look = Look::Metal,
            .paper =
                "B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, "
                "EGSR 2007",
            .equations = "f = F D G / (4 (n.i)(n.o)), eq. 20; G of Heitz 2014, eq. 99; F after Kutz et al. 2021",
            .doc = "Rough metal of microfacets, with the distribution and the masking that most renderers use.",
            .properties = {.isotropic = false,
                           .smooth = false,  // min() in the V-cavities' masking
                           .exact_sampling = false,
                           .specular_limit = "ax=1e-4 ay=1e-4",
                           .compensated = {"distribution", "multiscatter_ggx"}},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(f0, ColorSpec{"f0", "Normal Reflectance", {0.9, 0.6, 0.3}, "Reflectance of a facet seen from above"}.as(
              Optical::Reflectance));
    v(tint, ColorSpec{"tint", "Edge Tint", {1, 1, 1}, "Factor of the reflectance of facets seen at 82 degrees"});
    v(again, ColorSpec{"again",
                       "Interreflection",
                       {1, 1, 1},
                       "Share of the light that facets would reflect again: white adds all that single reflection "
                       "loses"});
    v(ax, NumberSpec{"ax", "Roughness X", 0.3, 1e-4, 1, 0.02, 1,
                     "alpha along the tangent: the square of the Roughness of Blender's nodes"}
              .by_factors());
    v(ay, NumberSpec{"ay", "Roughness Y", 0.3, 1e-4, 1, 0.02, 1,
                     "alpha across the tangent: the square of the Roughness of Blender's nodes"}
              .by_factors());
    v(distribution, ChoiceSpec{"distribution",
                               "Distribution",
                               {"ggx", "beckmann", "multiscatter_ggx"},
                               "ggx: a narrow highlight with a wide glow; beckmann: Gaussian slopes; multiscatter_ggx: "
                               "ggx with interreflection, which ignores the masking"});
    v(masking,
      ChoiceSpec{"masking",
                 "Masking",
                 {"smith_correlated", "smith_separable", "v_cavity"},
                 "Facets that hide others. smith_correlated: Heitz 2014; v_cavity: Torrance and Sparrow 1967"});
  }

  bool is_beckmann() const { return distribution == Beckmann; }
  /// The masking that counts.
  bool has_masking(int which) const { return (distribution == MultiscatterGgx ? SmithCorrelated : masking) == which; }

  Facets<T> surface() const { return {ax, ay, is_beckmann(), has_masking(VCavity) || is_beckmann()}; }

  /// G / (4 (n.i)(n.o)).
  T shape(const HalfVector<T>& k, const Vec3<T>& wi, const Vec3<T>& wo) const {
    if (has_masking(VCavity)) return v_cavity_shape(k, wi, wo) / T(4);
    return surface().smith_shape(has_masking(SmithCorrelated), wi, wo);
  }

  /// Of 1 - (o.h).
  Rgb<T> F(const T& one_minus_oh) const {
    const T s = T(7. / 6) * one_minus_oh, s2 = s * s;
    const T q = named("q", T(7) * (T(1) - one_minus_oh) * s2 * s2 * s2);
    const T rest = T(1) + s * (T(2) + s * (T(3) + s * (T(4) + s * (T(5) + s * T(6)))));
    const T untinted = named("untinted", sqr(T(1) - s) * rest);
    return named("F", schlick_fresnel(f0, one_minus_oh) * (Rgb<T>(untinted) + tint * q));
  }

  /// (1 - E) / E: what interreflection of the share 1 adds to f, over f.
  T gain(const Vec3<T>& wo) const {
    if (distribution != MultiscatterGgx) return T(0);
    const T alpha = named("alpha", sqrt(ax * ay)), z = maximum(wo.z, T(0)), m = named("m", z / (z + alpha));
    const T root = sqrt(m), x = named("x", T(2) * root - T(1)), y = named("y", T(2) * alpha - T(1));
    T sum(0);
    for (std::size_t i = kLost.size(); i-- > 0;) {
      T row(0);
      for (std::size_t j = kLost.size() - i; j-- > 0;) row = row * y + T(kLost[i][j]);
      sum = sum * x + row;
    }
    const T lost = named("lost", root * sqrt(root) * (T(1) - m) * sum);
    return named("gain", lost / (T(1) - lost));
  }
  /// The factor by which interreflection raises f.
  Rgb<T> compensation(const Vec3<T>& wo) const {
    if (distribution != MultiscatterGgx) return Rgb<T>(T(1));
    return named("compensation", Rgb<T>(T(1)) + again * gain(wo));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return F(k.one_minus_oh) * compensation(wo) * select(above(wi, wo), surface().D(k.h) * shape(k, wi, wo), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return surface().reflected_pdf(wi, wo); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> h = surface().sample_normal(wo, u).h;
    const Vec3<T> wi = h * (T(2) * dot(wo, h)) - wo;
    const HalfVector<T> k(wi, wo);
    const T v = surface().visible(k.h.z, k.oh, wo);
    const T weight = shape(k, wi, wo) * maximum(wi.z, T(0)) / maximum(v, tiny<T>());
    return sample_if(above(wi, wo), wi, F(k.one_minus_oh) * compensation(wo) * weight, surface().D(k.h) * v);
  }

  /// The same microfacets, with the Fresnel term at the middle of the lobe. Cycles has one closure for each
  /// distribution, with Smith's correlated masking; that of the other one is black. Separable masking hides more at
  /// grazing views.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const Rgb<T> none(T(0));
    const T height = lobe_height(wo.z, T(0.7) * (sqr(ax * wo.x) + sqr(ay * wo.y)));
    Rgb<T> weight = F(clamp01(T(1) - height)) * compensation(wo);
    if (has_masking(SmithSeparable)) {
      // (1 + 2 Lambda) / (1 + Lambda)^2 of the mirrored view, whose light is that of wo.
      const T z = maximum(wo.z, tiny<T>()), h = surface().hidden(wo);
      weight = weight * (z / (z + h) * ((z + T(2) * h) / (z + h)));
    }
    return {facets(ClosureKind::Ggx, is_beckmann() ? none : weight, ax, ay, T(0)),
            facets(ClosureKind::Beckmann, is_beckmann() ? weight : none, ax, ay, T(0))};
  }

  /// Cycles' closures, if the masking is theirs.
  ///
  /// Metal has the F of Kutz and others. With b = S(1/7) it is S - (1 - tint) b q, which is not above this F,
  /// S - (1 - tint) S q, as long as S is at most b: where facets are seen at 82 degrees or less. Light comes from
  /// within 90 degrees of the normal, so all facets are, seen from a cosine of kSteep or more. From below, the tint of
  /// the metal is 1 - (1 - tint) / b, which makes it darker than this F for S up to 1. Facets that the closure can't
  /// stretch so far have the least F: S is at least f0, and q at most 1.
  ///
  /// Interreflection multiplies F by a colour w, which metal can't have. With a white tint and p = (1 - c)^5
  ///   w S = w f0 + w (1 - f0) p = W (g + (1 - g) p) + (w - W),  g = 1 - w (1 - f0) / W,
  /// which is metal of the reflectance g and the grey weight W, and Glossy of the colour w - W. Both exist for a W from
  /// the largest channel of w (1 - f0) to the least of w; two metals have W up to 2.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    constexpr double kSteep = 0.2829;  // cos(2 acos(1/7) - 90 degrees)
    const Rgb<T> one(T(1)), none(T(0)), least = f0 * tint, w = compensation(wo);
    const bool smith = has_masking(SmithCorrelated);
    // Without a tint Cycles, which multiplies the two conditions, does not have to compare the view.
    const auto grazing = wo.z < T(kSteep) && T(0) < max_component(one - tint);
    const Rgb<T> edge = select(grazing, one - (one - tint) / fresnel_at_82(f0), tint);
    const auto is_metal = T(kLeastAspect) <= aspect() && max_component(one - edge) <= T(1);
    T W(1), more(0);
    Rgb<T> g = f0, share = least;  // `share`: of w - W
    if (smith && distribution == MultiscatterGgx) {
      const Rgb<T> rising = w * (one - f0);
      const T highest = minimum(T(1) + grey_again() * gain(wo), T(2));
      const auto is_white = max_component(one - tint) <= T(0);
      W = select(is_white, minimum(maximum(max_component(rising), T(1)), highest), highest);
      const auto is_all = is_metal && is_white && max_component(rising) <= W + T(kGrey);
      g = select(is_all, one - rising / W, f0);
      share = select(is_all, one, least);
      more = select(is_metal, W - T(1), T(0));
    }
    const auto metal = [&](ClosureKind kind, const T& weight) {
      Closure<T> c = facets(kind, Rgb<T>(weight), ax, ay, T(0));
      c.metal = true;
      c.f0 = g;
      c.edge = edge;
      return c;
    };
    const Rgb<T> left = share * (w - Rgb<T>(select(is_metal, W, T(0))));
    const auto rest = [&](ClosureKind kind, bool is_this) {
      return facets(kind, smith && is_this ? left : none, ax, ay, T(0));
    };
    const T first = select(is_metal, T(1), T(0));
    return {metal(ClosureKind::Ggx, smith && !is_beckmann() ? first : T(0)),
            metal(ClosureKind::Beckmann, smith && is_beckmann() ? first : T(0)), metal(ClosureKind::Ggx, more),
            rest(ClosureKind::Ggx, !is_beckmann()), rest(ClosureKind::Beckmann, is_beckmann())};
  }
  T aspect() const { return minimum(ax, ay) / maximum(ax, ay); }
  /// The least channel. Where no channel is above it by kGrey, interreflection is grey.
  T grey_again() const { return T(1) - max_component(Rgb<T>(T(1)) - again); }

  /// With a white tint F is Schlick's. Of interreflection, w is linear in gain(), so the metals of under() exist for
  /// all views if they do where gain() is largest: 0.13 + 2.15 alpha^2 at most. Grey interreflection needs no look at
  /// f0, which may not be known.
  T whole() const {
    if (!has_masking(SmithCorrelated)) return T(0);
    const Rgb<T> one(T(1));
    auto stands = max_component(one - tint) <= T(0) && T(kLeastAspect) <= aspect();
    if (distribution == MultiscatterGgx) {
      const T most = T(0.13) + T(2.15) * ax * ay, least = T(1) + grey_again() * most;
      const T rising = max_component((one + again * most) * (one - f0));
      const auto is_grey = max_component(again) <= grey_again() + T(kGrey);
      stands = stands && ((is_grey && least <= T(2)) || rising <= minimum(least, T(2)) + T(kGrey));
    }
    return select(stands, T(1), T(0));
  }
};

BRDFC_MODEL(Microfacet)
BRDFC_UNDER(Microfacet)

}  // namespace brdfc
