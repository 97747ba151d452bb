// SPDX-License-Identifier: GPL-3.0-or-later
// The Cycles closures a form may use, as data over a scalar type. evaluate() is their definition (read off what Cycles
// computes and proved against it by the closure conformance tests); the generator prints the same data as OSL.
// Directions are unit vectors in the local frame of the model, the surface's normal along z.
#pragma once

#include <array>
#include <stdexcept>
#include <vector>

#include "core/vec.h"

namespace brdfc::inline closures {

enum class ClosureKind {
  Diffuse,      ///< diffuse(N):             cos / pi
  Burley,       ///< burley_diffuse_bsdf(N, 1, 0): (c/pi)(1 - s_i/2)(1 - s_o/2), s = (1 - c)^5
  DiffuseRamp,  ///< diffuse_ramp(N, colours): ramp8(c) / pi, no cosine
  PhongRamp,    ///< phong_ramp(N, e, colours): ramp8(cos^e a) (N.wi) (e+2)/(2 pi) cos^e a
  Reflection,   ///< reflection(N): delta in the direction of ideal reflection
  Ggx,          ///< microfacet("ggx", N, 0, a, a, 1, 0): without Fresnel term, Smith's height-correlated masking
  Beckmann,     ///< microfacet("beckmann", ...): the same, with Walter's rational masking as Cycles has it
  GlossyToon,   ///< glossy_toon(N, size, smooth): a cone about the mirror direction, level within the angle `size` and
                ///< falling to 0 over `smooth`, linear in the angle; no cosine
  Refraction,   ///< refraction(N, ior): delta in the direction of ideal refraction, none beyond the critical angle
};

/// What the facets of a closure are stretched along, if they have two roughnesses.
enum class Tangent {
  None,    ///< nothing: they are round
  View,    ///< the plane of incidence: Cycles is given the viewer's direction
  Surface  ///< a direction fixed to the surface
};

/// How many entries a ramp has.
inline constexpr int kRampSize = 8;
/// Does it take the colours of a ramp?
inline bool has_ramp(ClosureKind kind) { return kind == ClosureKind::DiffuseRamp || kind == ClosureKind::PhongRamp; }

/// Does it take a roughness?
inline bool has_facets(ClosureKind kind) { return kind == ClosureKind::Ggx || kind == ClosureKind::Beckmann; }

/// A closure with its settings; those that its kind does not take have no meaning.
template <class T> struct Closure {
  ClosureKind kind;
  Rgb<T> weight;                       ///< factor of all that it scatters; not negative in Cycles
  Vec3<T> normal;                      ///< unit
  std::array<Rgb<T>, kRampSize> ramp;  ///< DiffuseRamp, PhongRamp; entries may be negative
  T exponent;                          ///< PhongRamp: >= 0
  T alpha;                             ///< Ggx, Beckmann: roughness in (0, 1], of stretched facets along `tangent`
  T alpha_across;                      ///< of stretched facets: across it
  Vec3<T> tangent;                     ///< of stretched facets: unit, perpendicular to the normal
  T size, smooth;                      ///< GlossyToon: in units of 90 degrees, from 0 to 1
  T ior;                               ///< Refraction: index of the far side over that of the viewer's
  bool turned = false;                 ///< `normal` is not the surface's; it is not below it
  Tangent stretched = Tangent::None;   ///< what `tangent` is

  Closure(ClosureKind kind_, const Rgb<T>& weight_)
      : kind(kind_),
        weight(weight_),
        normal{T(0), T(0), T(1)},
        exponent(0),
        alpha(1),
        alpha_across(1),
        tangent{T(1), T(0), T(0)},
        size(0),
        smooth(1),
        ior(1) {}
};

/// A shader's closures, added up.
template <class T> using ClosureSum = std::vector<Closure<T>>;

/// Smith's Lambda for the square of alpha times the tangent of the direction.
template <class T> T lambda(ClosureKind kind, const T& a2) {
  if (kind == ClosureKind::Ggx) return a2 / (T(2) * (sqrt(T(1) + a2) + T(1)));
  // Walter's rational fit, which leaves out all shadowing below a2 = 0.39.
  const T a = T(1) / sqrt(maximum(a2, tiny<T>()));
  return select(a2 < T(0.39), T(0), ((T(0.396) * a - T(1.259)) * a + T(1)) / ((T(2.181) * a + T(3.535)) * a));
}

/// f cos(theta_i) of facets without Fresnel term. Of the half vector, along the normal z2 and across it t2 in units of
/// alpha, both squared; of the directions what lambda() takes.
template <class T> T microfacet(ClosureKind kind, const T& alpha2, const T& t2, const T& z2, const T& slope_i,
                                const T& slope_o, const T& cosTheta_o) {
  const T density = kind == ClosureKind::Ggx ? T(1) / sqr(t2 + z2) : exp(-t2 / z2) / sqr(z2);
  const T D = T(kInvPi) / alpha2 * density;
  return D / (T(4) * cosTheta_o * (T(1) + lambda(kind, slope_i) + lambda(kind, slope_o)));
}

/// For directions above the surface in the frame of the closure.
template <class T>
T microfacet(ClosureKind kind, const T& alpha_x, const T& alpha_y, const Vec3<T>& wi, const Vec3<T>& wo) {
  const Vec3<T> h = normalize(wi + wo);
  const auto slope = [&](const Vec3<T>& v) {
    return (sqr(alpha_x * v.x) + sqr(alpha_y * v.y)) / maximum(sqr(v.z), tiny<T>());
  };
  return microfacet(kind, alpha_x * alpha_y, sqr(h.x / alpha_x) + sqr(h.y / alpha_y), maximum(sqr(h.z), tiny<T>()),
                    slope(wi), slope(wo), wo.z);
}

/// The same about any normal, on the side of which both directions are.
template <class T>
T microfacet(ClosureKind kind, const T& alpha, const Vec3<T>& normal, const Vec3<T>& wi, const Vec3<T>& wo) {
  // The sine of the half vector needs all its digits: smooth facets make much of little.
  const Vec3<T> across = cross(normal, normalize(wi + wo));
  const T alpha2 = sqr(alpha), sin2 = dot(across, across), cosTheta_o = dot(normal, wo);
  const auto slope = [&](const T& c) { return alpha2 * maximum(T(1) - sqr(c), T(0)) / maximum(sqr(c), tiny<T>()); };
  return microfacet(kind, alpha2, sin2 / alpha2, maximum(T(1) - sin2, tiny<T>()), slope(dot(normal, wi)),
                    slope(cosTheta_o), cosTheta_o);
}

/// The same of stretched facets, whose x axis is perpendicular to the normal. Cycles makes it so.
template <class T> T microfacet(ClosureKind kind, const T& alpha_x, const T& alpha_y, const Vec3<T>& normal,
                                const Vec3<T>& x, const Vec3<T>& wi, const Vec3<T>& wo) {
  const Vec3<T> y = cross(normal, x);
  const auto in_frame = [&](const Vec3<T>& v) { return Vec3<T>{dot(x, v), dot(y, v), dot(normal, v)}; };
  return microfacet(kind, alpha_x, alpha_y, in_frame(wi), in_frame(wo));
}

/// f cos(theta_i) of one closure with its weight; delta closures are 0. Directions above the surface. `ramp` is a
/// function that gives the ramp's colour at a position, which may lie above 1.
template <class T, class Ramp>
Rgb<T> evaluate(const Closure<T>& c, const Vec3<T>& wi, const Vec3<T>& wo, const Ramp& ramp) {
  const T cosTheta_i = c.turned ? dot(c.normal, wi) : wi.z, cosTheta_o = c.turned ? dot(c.normal, wo) : wo.z;
  const auto lit = cosTheta_i > T(0), both = lit && cosTheta_o > T(0);
  const Rgb<T> none(T(0));
  switch (c.kind) {
    case ClosureKind::Diffuse:
      return select(lit, c.weight * (cosTheta_i * T(kInvPi)), none);
    case ClosureKind::Burley: {
      const T pair = (T(1) - pow5(T(1) - cosTheta_i) / T(2)) * (T(1) - pow5(T(1) - cosTheta_o) / T(2));
      return select(lit, c.weight * (cosTheta_i * T(kInvPi) * pair), none);
    }
    case ClosureKind::DiffuseRamp:
      return select(lit, c.weight * ramp(cosTheta_i) * T(kInvPi), none);
    case ClosureKind::PhongRamp: {
      // Between wi and the mirror direction about the closure's normal.
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
      return select(both, c.weight * of_facets(), none);
    }
    case ClosureKind::GlossyToon: {
      const T cosAlpha = clamp01(T(2) * cosTheta_o * cosTheta_i - dot(wo, wi));
      const T angle = atan(sqrt((T(1) - cosAlpha) / (T(1) + cosAlpha))) * T(4 * kInvPi);
      const T outer = c.size + c.smooth, half = sin(minimum(outer, T(1)) * T(kPi / 4));
      const T height = clamp01((outer - angle) / maximum(c.smooth, tiny<T>())) * T(kInvPi / 4) / sqr(half);
      return select(both, c.weight * height, none);
    }
    case ClosureKind::Reflection:
    case ClosureKind::Refraction:
      return none;
  }
  throw std::logic_error("closure of unknown kind");
}

/// Linear look-up of a ramp at a position in [0, 1], outside which it keeps its ends: each piece begins where the one
/// before ends, so that a recording needs no index. Pieces between equal constants cost nothing.
template <class T> Rgb<T> ramp8(const std::array<Rgb<T>, kRampSize>& ramp, const T& position) {
  const T scaled = position * T(kRampSize - 1);
  Rgb<T> colour = ramp[0];
  for (int i = 0; i + 1 < kRampSize; ++i)
    colour += (ramp[std::size_t(i + 1)] - ramp[std::size_t(i)]) * clamp01(scaled - T(i));
  return colour;
}

/// With the colours of its own ramp.
template <class T> Rgb<T> evaluate(const Closure<T>& c, const Vec3<T>& wi, const Vec3<T>& wo) {
  return evaluate(c, wi, wo, [&](const T& position) { return ramp8(c.ramp, position); });
}
template <class T> Rgb<T> evaluate(const ClosureSum<T>& sum, const Vec3<T>& wi, const Vec3<T>& wo) {
  Rgb<T> total(T(0));
  for (const Closure<T>& c : sum) total += evaluate(c, wi, wo);
  return total;
}
/// The same with an index into the ramp, for the many evaluations of a fit.
Rgb<double> evaluate(const Closure<double>&, const Vec3<double>& wi, const Vec3<double>& wo);
Rgb<double> evaluate(const ClosureSum<double>&, const Vec3<double>& wi, const Vec3<double>& wo);

/// The most closures Cycles keeps of one shader (MAX_CLOSURE); a sum with more is refused.
inline constexpr int kMaxClosures = 64;

/// What a closure costs of those slots: a ramp needs extra storage for its colours. Measured.
int slots(ClosureKind);

}  // namespace brdfc::inline closures
