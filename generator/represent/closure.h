// SPDX-License-Identifier: GPL-3.0-or-later
// The Cycles closures a form may use, as data over a scalar type. evaluate() is their definition in double
// precision (read off what Cycles computes and proved against it by the closure conformance tests); the
// generator prints the same data as OSL. Directions are in the local frame of the model.
#pragma once

#include <array>
#include <vector>

#include "core/vec.h"

namespace brdfc {

enum class ClosureKind {
  Diffuse,      ///< diffuse(N):             cos / pi
  Burley,       ///< burley_diffuse_bsdf(N, 1, 0): (c/pi)(1 - s_i/2)(1 - s_o/2), s = (1 - c)^5
  DiffuseRamp,  ///< diffuse_ramp(N, colours): ramp8(c) / pi, no cosine
  PhongRamp,    ///< phong_ramp(N, e, colours): ramp8(cos^e a) (N.wi) (e+2)/(2 pi) cos^e a
  Reflection,   ///< reflection(N): delta in the direction of ideal reflection
  Ggx,          ///< microfacet("ggx", N, 0, a, a, 1, 0): without Fresnel term, Smith's height-correlated masking
  Beckmann,     ///< microfacet("beckmann", ...): the same, with Walter's rational masking as Cycles has it
  Refraction,   ///< refraction(N, ior): delta in the direction of ideal refraction, none beyond the critical angle
};

/// How many entries a ramp has.
inline constexpr int kRampSize = 8;
inline bool has_ramp(ClosureKind kind) { return kind == ClosureKind::DiffuseRamp || kind == ClosureKind::PhongRamp; }

inline bool has_facets(ClosureKind kind) { return kind == ClosureKind::Ggx || kind == ClosureKind::Beckmann; }

template <class T> struct Closure {
  ClosureKind kind;
  Rgb<T> weight;
  Vec3<T> normal;
  std::array<Rgb<T>, kRampSize> ramp;  ///< DiffuseRamp, PhongRamp; entries may be negative
  T exponent;                          ///< PhongRamp
  T alpha;                             ///< Ggx, Beckmann: roughness
  T ior;                               ///< Refraction: index of the far side over that of the viewer's
  bool turned = false;                 ///< `normal` is not the surface's

  Closure(ClosureKind kind_, const Rgb<T>& weight_)
      : kind(kind_), weight(weight_), normal{T(0), T(0), T(1)}, exponent(0), alpha(1), ior(1) {}
};

template <class T> using ClosureSum = std::vector<Closure<T>>;

/// f cos(theta_i) of facets without Fresnel term, for directions above the surface in the frame of the closure.
double microfacet(ClosureKind, double alpha_x, double alpha_y, const Vec3<double>& wi, const Vec3<double>& wo);

/// f cos(theta_i) of one closure with its weight; delta closures are 0. Directions above the surface.
Rgb<double> evaluate(const Closure<double>&, const Vec3<double>& wi, const Vec3<double>& wo);
Rgb<double> evaluate(const ClosureSum<double>&, const Vec3<double>& wi, const Vec3<double>& wo);

/// The most closures Cycles keeps of one shader (MAX_CLOSURE); a sum with more is refused.
inline constexpr int kMaxClosures = 64;

/// What a closure costs of those slots: a ramp needs extra storage for its colours. Measured.
int slots(ClosureKind);

}  // namespace brdfc
