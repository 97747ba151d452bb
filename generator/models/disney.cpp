// SPDX-License-Identifier: GPL-3.0-or-later
// Disney's material of 2012, also the Principled BSDF of Blender before 4.0 but for its refraction: a matte term with
// sheen, a highlight of ggx facets, and a clear coat.
//
// B. Burley: Physically Based Shading at Disney, SIGGRAPH 2012 course, section 5, and the code published with it (BRDF
// Explorer, disney.brdf), from which the constants are that the text leaves out. With s(c) = (1 - c)^5, F = s(o.h):
//   f = (1 - metallic) (color / pi mix(F_d, F_ss, subsurface) + F sheen C_sheen)
//       + D_ggx G_r (C + (1 - C) F) + clearcoat / 4 D_coat G_1/4 (0.04 + 0.96 F),
//   F_d: section 5.3, of model/burley.h,
//   F_ss = 5/4 ((1 - k s_i) (1 - k s_o) (1 / ((n.i) + (n.o)) - 1/2) + 1/2), k = 1 - roughness (o.h)^2, a flat
//     approximation of subsurface scattering after Hanrahan and Krueger,
//   C = mix(0.08 specular mix(1, hue, specular_tint), color, metallic), C_sheen = mix(1, hue, sheen_tint),
//   hue = color / (0.3 r + 0.6 g + 0.1 b), 1 if black,
//   D_ggx: of model/facets.h, with ax = max(0.001, roughness^2 / a), ay = max(0.001, roughness^2 a),
//     a = sqrt(1 - 0.9 anisotropic),
//   D_coat = (b^2 - 1) / (2 pi log(b) (1 + (b^2 - 1) (n.h)^2)), b = mix(0.1, 0.001, clearcoat_gloss),
//   G_a = 1 / (((n.i) + S_i) ((n.o) + S_o)), S = sqrt(a^2 + (n.w)^2 - a^2 (n.w)^2): Smith's separable masking over
//     4 (n.i) (n.o).
// Of the masking of the highlight there are two versions. In the course a = (1/2 + roughness / 2)^2, so that smooth
// surfaces gain less towards the rim than with the facets' own masking (choice remapped). Code from 2014 on, and
// Blender's, take the facets' own, S = sqrt((ax w.x)^2 + (ay w.y)^2 + (n.w)^2) (choice facets). The published code
// takes colours to the power of 2.2, as they are display-referred there; here they are linear. Blender's hue has other
// weights, 0.2126, 0.7152 and 0.0722, and its Specular of 0.5 is the same as here.
//
// Energy. The layers are added up, and nothing takes off below what is reflected above; the matte term gains light by
// itself. With a base color of 1 the albedo is 1.04 from above by default and up to 1.09 near the horizon; with sheen,
// clearcoat and roughness at 1 it is 1.06 from above and 1.69 near the horizon. Rough metals lose light instead: with
// roughness 1 the albedo is 0.31 from above and 0.61 near the horizon. f is reciprocal.
//
// Numerical stability. F_ss needs no half vector: (o.h)^2 = (1 + wi.wo) / 2. Near the horizon 1 - k s loses digits; (1
// - k) + k (1 - s) does not, where 1 - s is a polynomial in the cosine. D_coat is (1 - b^2) / (-2 pi log(b) (sin^2
// theta_h + b^2 (n.h)^2)), from the half vector's components.
//
// Sampling chooses among Lambert's cosine, visible normals of ggx and normals of the coat, with shares after their
// albedos.
#include "model/base_terms.h"
#include "model/burley.h"
#include "model/facets.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Disney {
  Rgb<T> color;
  T metallic, subsurface, specular, specular_tint, roughness, anisotropic, sheen, sheen_tint, clearcoat,
      clearcoat_gloss;
  Choice masking;

  enum { Remapped, OfFacets };

  static ModelInfo info() {
    return {.name = "disney",
            .label = "Disney 2012",
            .look = Look::Special,
            .paper = "B. Burley: Physically Based Shading at Disney, SIGGRAPH 2012 course",
            .equations = "section 5 and the code published with it",
            .doc = "Matte, metallic or plastic surface with sheen and a clear coat, by Disney's sliders of 2012.",
            .properties = {.conserving = false,
                           .isotropic = false,
                           .exact_sampling = false,
                           .specular_limit = "metallic=1 roughness=0",
                           .albedo_table = false,
                           .fit_axis = "roughness"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(color, ColorSpec{"base_color", "Base Color", {0.8, 0.8, 0.8}, "Color of the matte term, and of a metal"});
    const auto share = [](const char* name, const char* label, double value, const char* doc) {
      return NumberSpec{name, label, value, 0, 1, 0, 1, doc};
    };
    v(metallic, share("metallic", "Metallic", 0, "1: no matte term, and a highlight in the base color"));
    v(roughness, share("roughness", "Roughness", 0.5, "Its square is the facets' alpha; also widens the matte rim"));
    v(subsurface, share("subsurface", "Subsurface", 0, "Share of a flatter matte term, as of skin or wax"));
    v(specular, share("specular", "Specular", 0.5, "Highlight of what is no metal: 0.5 is an index of 1.5"));
    v(specular_tint, share("specular_tint", "Specular Tint", 0, "1: that highlight has the base color's hue"));
    v(anisotropic, share("anisotropic", "Anisotropic", 0, "Stretches the highlight along the tangent"));
    v(sheen, share("sheen", "Sheen", 0, "Brightens the rim where the lamp is behind the surface, as cloth"));
    v(sheen_tint, share("sheen_tint", "Sheen Tint", 0.5, "1: the sheen has the base color's hue"));
    v(clearcoat, share("clearcoat", "Clearcoat", 0, "A second highlight, without color"));
    v(clearcoat_gloss, share("clearcoat_gloss", "Clearcoat Gloss", 1, "0: satin; 1: glossy"));
    v(masking, ChoiceSpec{"masking",
                          "Masking",
                          {"remapped", "facets"},
                          "Facets that hide others. remapped: as in 2012; facets: as from 2014 on, and in Blender"});
  }

  Facets<T> highlight() const {
    const T a = named("aspect", sqrt(T(1) - T(0.9) * anisotropic)), r2 = roughness * roughness;
    return {named("ax", maximum(r2 / a, T(0.001))), named("ay", maximum(r2 * a, T(0.001))), false, false};
  }
  static Rgb<T> mix(const Rgb<T>& a, const Rgb<T>& b, const T& t) { return a + (b - a) * t; }

  Rgb<T> hue() const {
    const auto channel = [&](const Rgb<T>& one) { return max_component(color * one); };
    const T lum = named("lum", T(0.3) * channel({T(1), T(0), T(0)}) + T(0.6) * channel({T(0), T(1), T(0)}) +
                                   T(0.1) * channel({T(0), T(0), T(1)}));
    return select(lum > T(0), color / maximum(lum, tiny<T>()), Rgb<T>(T(1)));
  }
  Rgb<T> C() const {
    return named("C", mix(mix(Rgb<T>(T(1)), hue(), specular_tint) * (T(0.08) * specular), color, metallic));
  }

  /// F_ss, for the cosines of both directions and wi.wo.
  T flat(const T& ci, const T& co, const T& across) const {
    const T facing = roughness * ((T(1) + across) / T(2));  // 1 - k
    const auto factor = [&](const T& c) { return facing + (T(1) - facing) * one_minus_schlick_weight(c); };
    return T(1.25) * (factor(ci) * factor(co) * (T(1) / maximum(ci + co, tiny<T>()) - T(0.5)) + T(0.5));
  }

  /// What is below the highlights.
  Rgb<T> matte(const T& F, const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T d = burley_diffuse(roughness, wi, wo);
    const Rgb<T> rim = mix(Rgb<T>(T(1)), hue(), sheen_tint) * (F * sheen);
    return (color * ((d + (flat(wi.z, wo.z, dot(wi, wo)) - d) * subsurface) / pi<T>()) + rim) * (T(1) - metallic);
  }

  /// 1 / ((n.w) + S) with masking of the roughness a.
  static T masked(const T& cosTheta, const T& a) {
    const T c = maximum(cosTheta, T(0));
    return T(1) / maximum(c + sqrt(a * a * (T(1) - c * c) + c * c), tiny<T>());
  }
  T remapped() const { return named("a", sqr(T(0.5) + roughness / T(2))); }
  /// G / (4 (n.i) (n.o)) of the highlight.
  T shape(const Facets<T>& g, const Vec3<T>& wi, const Vec3<T>& wo) const {
    if (masking == OfFacets) return g.smith_shape(false, wi, wo);
    return masked(wi.z, remapped()) * masked(wo.z, remapped());
  }

  T coat_width() const { return named("b", T(0.1) - T(0.099) * clearcoat_gloss); }
  T D_coat(const Vec3<T>& h) const {
    const T b2 = sqr(coat_width());
    return named("D_coat", (T(1) - b2) / (-pi<T>() * log(b2) * (sqr(h.x) + sqr(h.y) + b2 * sqr(h.z))));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    const Facets<T> g = highlight();
    const T F = named("F", pow5(k.one_minus_oh));
    Rgb<T> f = matte(F, wi, wo) + mix(C(), Rgb<T>(T(1)), F) * (g.D(k.h) * shape(g, wi, wo));
    const T coat = T(0.25) * clearcoat * D_coat(k.h) * (T(0.04) + T(0.96) * F);
    f += Rgb<T>(named("coat", coat * masked(wi.z, T(0.25)) * masked(wo.z, T(0.25))));
    return select(above(wi, wo), f, Rgb<T>(T(0)));
  }

  /// The shares of samples of the highlight and of the coat, about as their albedos.
  std::array<T, 2> shares(const Vec3<T>& wo) const {
    const T F = schlick_weight(wo.z), c = max_component(C());
    const T below = (max_component(color) + T(0.1) * sheen) * (T(1) - metallic) + T(0.02);
    const T above_it = (c + (T(1) - c) * F) * (T(1) - T(0.5) * roughness), coat = clearcoat * (T(0.02) + T(0.2) * F);
    const T all = below + above_it + coat;
    return {named("share_highlight", above_it / all), named("share_coat", coat / all)};
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    const Facets<T> g = highlight();
    const auto [high, coat] = shares(wo);
    const T p = (T(1) - high - coat) * cosine_pdf(wi) + high * g.D(k.h) * g.visible(k.h.z, k.oh, wo) +
                coat * D_coat(k.h) * k.h.z / (T(4) * maximum(k.oh, tiny<T>()));
    return select(above(wi, wo), p, T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const auto [high, coat] = shares(wo);
    const T b2 = sqr(coat_width());
    // The cumulative distribution of sin^2 theta_h is log(1 + (1 / b2 - 1) sin^2) / -log(b2).
    const T sin2 = minimum(b2 * expm1(-u.y * log(b2)) / (T(1) - b2), T(1)), sine = sqrt(sin2);
    const T phi = T(2) * pi<T>() * u.z;
    const Vec3<T> of_coat = {sine * cos(phi), sine * sin(phi), sqrt(T(1) - sin2)};
    const Vec3<T> h = select(u.x < coat, of_coat, highlight().sample_caps(wo, u.y, u.z));
    const Vec3<T> wi = select(u.x < high + coat, h * (T(2) * dot(wo, h)) - wo, sample_cosine(u.y, u.z));
    const T p = pdf(wi, wo);
    return sample_if(above(wi, wo), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
  }

  /// All but sheen and coat: the flat term with the mean of (o.h)^2 over the azimuth, and the highlight with the
  /// Fresnel term of the middle of its lobe. A closure can't stretch facets to a roughness above 1.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const Facets<T> g = highlight();
    const T z = maximum(wo.z, tiny<T>()), hidden = g.hidden(wo);
    const Rgb<T> below = color * (T(1) - metallic);
    Closure<T> burley(ClosureKind::Burley, below * (T(1) - subsurface));
    burley.roughness = roughness;
    const auto flat_towards = [&](const T& c) { return flat(c, z, c * z); };
    const T albedo = flat_towards(T(0.6));
    Closure<T> ramp(ClosureKind::DiffuseRamp, below * (subsurface * albedo));
    ramp.ramp[0] = Rgb<T>(T(0));
    for (int i = 1; i < kRampSize; ++i) {
      const T c(i / double(kRampSize - 1));
      ramp.ramp[std::size_t(i)] = Rgb<T>(c * flat_towards(c) / albedo);
    }
    const T height = lobe_height(wo.z, T(0.7) * (sqr(g.ax * wo.x) + sqr(g.ay * wo.y)));
    // Cycles' masking at the mirrored view is 1 / (1 + 2 Lambda).
    const T of_cycles = (z + T(2) * hidden) / (z * maximum(g.ax, T(1)));
    const T ours = masking == OfFacets ? sqr(z / (z + hidden)) : sqr(T(2) * z * masked(z, remapped()));
    const Rgb<T> F = mix(C(), Rgb<T>(T(1)), schlick_weight(clamp01(height)));
    return {burley, ramp, facets(ClosureKind::Ggx, F * (ours * of_cycles), g.ax, g.ay, T(0))};
  }

  /// Lambert's law, and the same facets with the masking of Cycles, 1 / (1 + L_i + L_o) with Smith's Lambda L of ggx.
  /// Separable masking of the same facets is at least that over 1 + L_o. With the roughness a instead, which is larger,
  /// 1 + L_i is at most a / min(ax, ay) times as large as that of the facets. A closure can't stretch facets to a
  /// roughness above 1.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const Facets<T> g = highlight();
    const T z = maximum(wo.z, tiny<T>());
    const T matte = (T(1) - subsurface) * least_burley_diffuse(roughness, wo) + subsurface * T(0.625);
    const T seen = masking == OfFacets
                       ? z / (z + g.hidden(wo))
                       : minimum(minimum(g.ax, g.ay) / remapped(), T(1)) * (T(2) * z * masked(z, remapped()));
    Closure<T> glossy = facets(ClosureKind::Ggx, Rgb<T>(select(g.ax <= T(1), seen, T(0))), g.ax, g.ay, T(0));
    glossy.metal = true;
    glossy.f0 = C();
    return {Closure<T>(ClosureKind::Diffuse, color * ((T(1) - metallic) * matte)), glossy};
  }
};

BRDFC_MODEL(Disney)
BRDFC_UNDER(Disney)

}  // namespace brdfc
