// SPDX-License-Identifier: GPL-3.0-or-later
// The Cycles closures that a form may use, as data over a scalar type. evaluate() defines them. The definitions were
// taken from Cycles' code, and the closure conformance tests compare them with what Cycles computes. The generator
// prints the same data as OSL. Directions are unit vectors in the local frame of the model, with the surface's normal
// along z.
#pragma once

#include <array>
#include <stdexcept>
#include <vector>

#include "core/vec.h"

namespace brdfc::inline closures {

enum class ClosureKind {
  Diffuse,    ///< diffuse(N):             cos / pi
  Burley,     ///< burley_diffuse_bsdf(N, 1, roughness): (c/pi)(1 - k s_i)(1 - k s_o), s = (1 - c)^5,
              ///< k = 1/2 - 2 roughness (wi.h)^2
  OrenNayar,  ///< oren_nayar_diffuse_bsdf(N, albedo, roughness): Fujii's form of Oren and Nayar's model with facets of
              ///< `albedo`, and interreflection between them
  Velvet,     ///< ashikhmin_velvet(N, roughness): upright fibres, bright at grazing angles
  DiffuseToon,  ///< diffuse_toon(N, size, smooth): as GlossyToon, about the normal
  DiffuseRamp,  ///< diffuse_ramp(N, colours): ramp8(c) / pi, without a cosine
  PhongRamp,    ///< phong_ramp(N, e, colours): ramp8(cos^e a) (N.wi) (e+2)/(2 pi) cos^e a
  Reflection,   ///< reflection(N): delta in the direction of ideal reflection
  Ggx,          ///< microfacet("ggx", N, 0, a, a, 1, 0): no Fresnel term but that of Closure::metal, Smith's
                ///< height-correlated masking
  Beckmann,     ///< microfacet("beckmann", ...): the same, with Walter's rational masking as in Cycles
  GlossyToon,   ///< glossy_toon(N, size, smooth): a cone about the mirror direction, constant within `size` and
                ///< decreasing to 0 over `smooth`, linearly in the angle; without a cosine
  Refraction,   ///< refraction(N, ior): delta in the direction of ideal refraction, 0 beyond the critical angle
};

/// The direction along which the facets of an anisotropic closure are stretched.
enum class Tangent {
  None,    ///< none: isotropic
  View,    ///< the plane of incidence: Cycles gets the view direction as tangent
  Surface  ///< a direction fixed to the surface
};

/// Number of colours in a ramp.
inline constexpr int kRampSize = 8;
/// True if the closure takes the colours of a ramp.
inline bool has_ramp(ClosureKind kind) { return kind == ClosureKind::DiffuseRamp || kind == ClosureKind::PhongRamp; }

/// True if the closure takes one or two microfacet roughnesses.
inline bool has_facets(ClosureKind kind) { return kind == ClosureKind::Ggx || kind == ClosureKind::Beckmann; }

/// True if the closure takes the roughness of a matte surface.
inline bool has_matte_roughness(ClosureKind kind) {
  return kind == ClosureKind::Burley || kind == ClosureKind::OrenNayar || kind == ClosureKind::Velvet;
}

/// True if the closure takes an angle and the width of its edge.
inline bool has_cone(ClosureKind kind) { return kind == ClosureKind::GlossyToon || kind == ClosureKind::DiffuseToon; }

/// A closure with its settings. Settings that its kind does not take are ignored.
template <class T> struct Closure {
  ClosureKind kind;
  Rgb<T> weight;                       ///< factor of all that it scatters; not negative in Cycles
  Vec3<T> normal;                      ///< unit
  std::array<Rgb<T>, kRampSize> ramp;  ///< DiffuseRamp, PhongRamp; entries may be negative
  T exponent;                          ///< PhongRamp: >= 0
  T alpha;                             ///< Ggx, Beckmann: roughness in (0, 1]; if anisotropic, along `tangent`
  T alpha_across;                      ///< if anisotropic: roughness across `tangent`
  Vec3<T> tangent;                     ///< if anisotropic: unit, perpendicular to the normal
  T roughness;                         ///< Burley, OrenNayar, Velvet: from 0 to 1
  Rgb<T> albedo;                       ///< OrenNayar: albedo of the facets, from 0 to 1
  T size, smooth;                      ///< toons: in units of 90 degrees, from 0 to 1
  T ior;                               ///< Refraction: index of the far side over that of the viewer's
  Rgb<T> f0;                           ///< if `metal`: reflectance of a facet seen from above, from 0 to 1
  Rgb<T> edge;                         ///< if `metal`: Edge Tint, from 0 to 1
  bool turned = false;                 ///< true if `normal` is not the surface's; it must not point below the surface
  Tangent stretched = Tangent::None;   ///< the kind of `tangent`
  /// Ggx, Beckmann: true if facets have metal_fresnel(), as in Blender's Metallic BSDF with the Fresnel type F82 Tint,
  /// whose weight is a Mix Shader, from 0 to 1. With a white Edge Tint generalized_schlick_bsdf() is the same.
  bool metal = false;

  Closure(ClosureKind kind_, const Rgb<T>& weight_)
      : kind(kind_),
        weight(weight_),
        normal{T(0), T(0), T(1)},
        exponent(0),
        alpha(1),
        alpha_across(1),
        tangent{T(1), T(0), T(0)},
        roughness(0),
        albedo(T(0)),
        size(0),
        smooth(1),
        ior(1),
        f0(T(0)),
        edge(T(1)) {}
};

/// The closures of a shader; their sum is its BSDF.
template <class T> using ClosureSum = std::vector<Closure<T>>;

/// Schlick's Fresnel term of facets seen at 82 degrees, where the cosine is 1/7.
template <class T> Rgb<T> fresnel_at_82(const Rgb<T>& f0) {
  constexpr double kGrazing = 7776. / 16807;  // (6/7)^5
  return f0 + (Rgb<T>(T(1)) - f0) * T(kGrazing);
}
/// The Fresnel term of metals with an Edge Tint, as a function of one minus the cosine at which facets are seen. P.
/// Kutz, M. Hasan, D. Edmondson: Novel Aspects of the Adobe Standard Material, 2021; Cycles takes what is negative for
/// 0.
template <class T> Rgb<T> metal_fresnel(const Rgb<T>& f0, const Rgb<T>& edge, const T& one_minus_cos) {
  const Rgb<T> one(T(1));
  const T s = T(7. / 6) * one_minus_cos, s2 = s * s, q = T(7) * (T(1) - one_minus_cos) * s2 * s2 * s2;
  const Rgb<T> F = f0 + (one - f0) * pow5(one_minus_cos) - (one - edge) * fresnel_at_82(f0) * q;
  return (F + sqrt(F * F)) * T(0.5);
}

/// Smith's Lambda, from the square of alpha times the tangent of the direction's angle.
template <class T> T lambda(ClosureKind kind, const T& a2) {
  if (kind == ClosureKind::Ggx) return a2 / (T(2) * (sqrt(T(1) + a2) + T(1)));
  // Walter's rational approximation, which sets Lambda to 0 below a2 = 0.39.
  const T a = T(1) / sqrt(maximum(a2, tiny<T>()));
  return select(a2 < T(0.39), T(0), ((T(0.396) * a - T(1.259)) * a + T(1)) / ((T(2.181) * a + T(3.535)) * a));
}

/// f cos(theta_i) of microfacets without a Fresnel term. `t2` and `z2` are the squared components of the half vector:
/// across the normal, in units of alpha, and along it. The slopes are the arguments of lambda() for the two directions.
template <class T> T microfacet(ClosureKind kind, const T& alpha2, const T& t2, const T& z2, const T& slope_i,
                                const T& slope_o, const T& cosTheta_o) {
  const T density = kind == ClosureKind::Ggx ? T(1) / sqr(t2 + z2) : exp(-t2 / z2) / sqr(z2);
  const T D = T(kInvPi) / alpha2 * density;
  return D / (T(4) * cosTheta_o * (T(1) + lambda(kind, slope_i) + lambda(kind, slope_o)));
}

/// For directions above the surface, in the frame of the closure.
template <class T>
T microfacet(ClosureKind kind, const T& alpha_x, const T& alpha_y, const Vec3<T>& wi, const Vec3<T>& wo) {
  const Vec3<T> h = normalize(wi + wo);
  const auto slope = [&](const Vec3<T>& v) {
    return (sqr(alpha_x * v.x) + sqr(alpha_y * v.y)) / maximum(sqr(v.z), tiny<T>());
  };
  return microfacet(kind, alpha_x * alpha_y, sqr(h.x / alpha_x) + sqr(h.y / alpha_y), maximum(sqr(h.z), tiny<T>()),
                    slope(wi), slope(wo), wo.z);
}

/// The same about any normal. Both directions must be on its side.
template <class T>
T microfacet(ClosureKind kind, const T& alpha, const Vec3<T>& normal, const Vec3<T>& wi, const Vec3<T>& wo) {
  // Computed from the sine of the half vector, which needs its full precision: smooth facets amplify small errors.
  const Vec3<T> across = cross(normal, normalize(wi + wo));
  const T alpha2 = sqr(alpha), sin2 = dot(across, across), cosTheta_o = dot(normal, wo);
  const auto slope = [&](const T& c) { return alpha2 * maximum(T(1) - sqr(c), T(0)) / maximum(sqr(c), tiny<T>()); };
  return microfacet(kind, alpha2, sin2 / alpha2, maximum(T(1) - sin2, tiny<T>()), slope(dot(normal, wi)),
                    slope(cosTheta_o), cosTheta_o);
}

/// The same for anisotropic facets. The x axis must be perpendicular to the normal; Cycles makes it so.
template <class T> T microfacet(ClosureKind kind, const T& alpha_x, const T& alpha_y, const Vec3<T>& normal,
                                const Vec3<T>& x, const Vec3<T>& wi, const Vec3<T>& wo) {
  const Vec3<T> y = cross(normal, x);
  const auto in_frame = [&](const Vec3<T>& v) { return Vec3<T>{dot(x, v), dot(y, v), dot(normal, v)}; };
  return microfacet(kind, alpha_x, alpha_y, in_frame(wi), in_frame(wo));
}

/// The energy that a rough matte surface loses of light that comes from or goes to a direction with this cosine: see
/// rough_matte(). It is Fujii's G, with (1 - sin^3) / cos rearranged to keep its precision near the horizon.
template <class T> T matte_loss(const T& c) {
  const T s = sqrt(maximum(T(1) - sqr(c), T(0)));
  const T theta = T(2) * atan(s / (T(1) + c));
  const T grooves = s * (theta - T(2.0 / 3) - s * c) + T(2.0 / 3) * s * c * (T(1) + s + s * s) / (T(1) + s);
  return T(kPi / 2 - 2.0 / 3) - grooves;
}

/// The cosine-weighted mean of matte_loss() over all directions.
inline constexpr double kMeanMatteLoss = kPi / 2 - 2.0 / 3 - (2 * kPi - 5.6) / 3;

/// Rough matte facets, as the terms that colours multiply: M. Oren, S. Nayar: Generalization of Lambert's Reflectance
/// Model, SIGGRAPH 1994, in the form of Y. Fujii: A Tiny Improvement of Oren-Nayar Reflectance Model; with
/// interreflection between facets as in J. Portsmouth, P. Kutz, S. Hill: EON: A Practical Energy-Preserving Rough
/// Diffuse BRDF, JCGT 2025.
template <class T> struct RoughMatte {
  T level;      ///< f of white facets, without interreflection, seen from above
  T once;       ///< f of white facets, without interreflection
  T again;      ///< what white facets lack of a lossless surface
  T mean_loss;  ///< the mean share of the light that facets send to other facets

  /// `s` is the scalar product of the directions' components along the surface.
  RoughMatte(const T& roughness, const T& cosTheta_i, const T& cosTheta_o, const T& s) {
    level = T(1) / (T(kPi) + roughness * T(kPi / 2 - 2.0 / 3));
    const T b = roughness * level;
    const T t = select(s > T(0), s / maximum(maximum(cosTheta_i, cosTheta_o), tiny<T>()), s);
    once = level + b * t;
    // 1 - E(c) = b matte_loss(c), with the mean b kMeanMatteLoss. This form keeps its precision for smooth surfaces.
    again = b * matte_loss(cosTheta_i) * matte_loss(cosTheta_o) * T(kInvPi / kMeanMatteLoss);
    mean_loss = b * T(kMeanMatteLoss);
  }
  /// f of the light that facets of this albedo reflect twice or more.
  Rgb<T> interreflection(const Rgb<T>& albedo) const {
    return albedo * albedo * ((T(1) - mean_loss) * again) / (Rgb<T>(T(1)) - albedo * mean_loss);
  }
};

/// f of the closure OrenNayar without its weight. Cycles multiplies the interreflection by the albedo once more than
/// the paper does.
template <class T> Rgb<T> rough_matte(const T& roughness, const Rgb<T>& albedo, const T& cosTheta_i,
                                      const T& cosTheta_o, const T& cosine) {
  const RoughMatte<T> facets(roughness, cosTheta_i, cosTheta_o, cosine - cosTheta_i * cosTheta_o);
  return albedo * (Rgb<T>(facets.once) + facets.interreflection(albedo));
}

/// f cos(theta_i) of the closure Velvet without its weight: M. Ashikhmin, S. Premoze: Distribution-based BRDFs, 2007.
/// `sin2` is the squared sine of the half vector.
template <class T>
T velvet(const T& roughness, const T& sin2, const T& cosTheta_i, const T& cosTheta_o, const T& cosine) {
  const T sigma2 = sqr(maximum(roughness, T(0.01)));
  // Below this limit Cycles returns 0, and the exponential is 0 as well.
  const T s2 = maximum(sin2, T(2e-5)), z2 = maximum(T(1) - sin2, T(0));
  const T D = exp(-z2 / (s2 * sigma2)) / (sigma2 * sqr(s2)) * T(kInvPi);
  // (n.h) / (wi.h), where (wi.h)^2 is (1 + wi.wo) / 2.
  const T ratio = sqrt(z2 / maximum((T(1) + cosine) / T(2), tiny<T>()));
  const T G = minimum(T(1), T(2) * ratio * minimum(cosTheta_i, cosTheta_o));
  return D * G / (T(4) * maximum(cosTheta_o, tiny<T>()));
}

/// A cone about a direction, without weight; `cosAngle` is the cosine of the angle between wi and that direction.
template <class T> T toon(const T& size, const T& smooth, const T& cosAngle) {
  const T c = clamp01(cosAngle);
  const T angle = atan(sqrt((T(1) - c) / (T(1) + c))) * T(4 * kInvPi);
  const T outer = size + smooth, half = sin(minimum(outer, T(1)) * T(kPi / 4));
  return clamp01((outer - angle) / maximum(smooth, tiny<T>())) * T(kInvPi / 4) / sqr(half);
}

/// f cos(theta_i) of one closure with its weight; 0 for delta closures. Directions must be above the surface. `ramp` is
/// a function that returns the ramp's colour at a position, which may be above 1.
template <class T, class Ramp>
Rgb<T> evaluate(const Closure<T>& c, const Vec3<T>& wi, const Vec3<T>& wo, const Ramp& ramp) {
  const T cosTheta_i = c.turned ? dot(c.normal, wi) : wi.z, cosTheta_o = c.turned ? dot(c.normal, wo) : wo.z;
  const auto lit = cosTheta_i > T(0), both = lit && cosTheta_o > T(0);
  const Rgb<T> none(T(0));
  switch (c.kind) {
    case ClosureKind::Diffuse:
      return select(lit, c.weight * (cosTheta_i * T(kInvPi)), none);
    case ClosureKind::Burley: {
      const T k = T(0.5) - c.roughness * (T(1) + dot(wi, wo));
      const T pair = (T(1) - pow5(T(1) - cosTheta_i) * k) * (T(1) - pow5(T(1) - cosTheta_o) * k);
      return select(lit, c.weight * (cosTheta_i * T(kInvPi) * pair), none);
    }
    case ClosureKind::OrenNayar:
      return select(
          lit, c.weight * rough_matte(c.roughness, c.albedo, cosTheta_i, cosTheta_o, dot(wi, wo)) * cosTheta_i, none);
    case ClosureKind::Velvet: {
      const Vec3<T> across = cross(c.normal, normalize(wi + wo));
      return select(both, c.weight * velvet(c.roughness, dot(across, across), cosTheta_i, cosTheta_o, dot(wi, wo)),
                    none);
    }
    case ClosureKind::DiffuseToon:
      return select(lit, c.weight * toon(c.size, c.smooth, cosTheta_i), none);
    case ClosureKind::DiffuseRamp:
      return select(lit, c.weight * ramp(cosTheta_i) * T(kInvPi), none);
    case ClosureKind::PhongRamp: {
      // The angle between wi and the mirror direction about the closure's normal.
      const T cosAlpha = T(2) * cosTheta_o * cosTheta_i - dot(wo, wi);
      const T lobe = pow(maximum(cosAlpha, tiny<T>()), c.exponent);
      const T height = cosTheta_i * ((c.exponent + T(2)) * T(kInvPi / 2)) * lobe;
      return select(both && cosAlpha > T(0), c.weight * ramp(lobe) * height, none);
    }
    case ClosureKind::Ggx:
    case ClosureKind::Beckmann: {
      const auto of_facets = [&] {
        if (c.stretched != Tangent::None)
          return microfacet(c.kind, c.alpha, c.alpha_across, c.normal, c.tangent, wi, wo);
        if (c.turned) return microfacet(c.kind, c.alpha, c.normal, wi, wo);
        return microfacet(c.kind, c.alpha, c.alpha, wi, wo);
      };
      if (!c.metal) return select(both, c.weight * of_facets(), none);
      // From the sine of half the angle between the directions, whose squared distance is four times its square.
      const Vec3<T> between = wi - wo;
      const T sin2 = dot(between, between) / T(4);
      const T one_minus_cos = sin2 / (T(1) + sqrt(maximum(T(1) - sin2, T(0))));
      return select(both, c.weight * metal_fresnel(c.f0, c.edge, one_minus_cos) * of_facets(), none);
    }
    case ClosureKind::GlossyToon: {
      const T cosAlpha = T(2) * cosTheta_o * cosTheta_i - dot(wo, wi);
      return select(both, c.weight * toon(c.size, c.smooth, cosAlpha), none);
    }
    case ClosureKind::Reflection:
    case ClosureKind::Refraction:
      return none;
  }
  throw std::logic_error("closure of unknown kind");
}

/// Linear interpolation of a ramp at a position in [0, 1]; positions outside get the colours at the ends. Each piece
/// adds to the one before it, so that a recording needs no index. Pieces between equal constants cost nothing.
template <class T> Rgb<T> ramp8(const std::array<Rgb<T>, kRampSize>& ramp, const T& position) {
  const T scaled = position * T(kRampSize - 1);
  Rgb<T> colour = ramp[0];
  for (int i = 0; i + 1 < kRampSize; ++i)
    colour += (ramp[std::size_t(i + 1)] - ramp[std::size_t(i)]) * clamp01(scaled - T(i));
  return colour;
}

/// The same with the closure's own ramp.
template <class T> Rgb<T> evaluate(const Closure<T>& c, const Vec3<T>& wi, const Vec3<T>& wo) {
  return evaluate(c, wi, wo, [&](const T& position) { return ramp8(c.ramp, position); });
}
template <class T> Rgb<T> evaluate(const ClosureSum<T>& sum, const Vec3<T>& wi, const Vec3<T>& wo) {
  Rgb<T> total(T(0));
  for (const Closure<T>& c : sum) total += evaluate(c, wi, wo);
  return total;
}
/// The same with an index into the ramp, which is faster for the many evaluations of a fit.
Rgb<double> evaluate(const Closure<double>&, const Vec3<double>& wi, const Vec3<double>& wo);
Rgb<double> evaluate(const ClosureSum<double>&, const Vec3<double>& wi, const Vec3<double>& wo);

/// The largest number of closures that Cycles keeps per shader (MAX_CLOSURE). A sum with more is rejected.
inline constexpr int kMaxClosures = 64;

/// The number of those slots that a closure takes: a ramp needs additional storage for its colours. Measured.
int slots(ClosureKind);

}  // namespace brdfc::inline closures
