// SPDX-License-Identifier: GPL-3.0-or-later
// All Cycles closures that a form uses or might use, with all their settings, for the conformance tests and fits. Those
// that forms use are defined in closure.h, and only there; this file adds the others.
#pragma once

#include <string>

#include "closures/closure.h"

namespace brdfc::inline closures {

enum class LobeKind {
  Diffuse,
  Burley,
  OrenNayar,
  Velvet,
  DiffuseRamp,
  PhongRamp,
  Reflection,
  // microfacet(distribution, N, T, alpha_x, alpha_y, 1, 0): without a Fresnel term.
  Ggx,               ///< Smith's height-correlated masking
  Beckmann,          ///< the same with Walter's rational approximation, as in Cycles
  AshikhminShirley,  ///< eq. 16 of their paper, n = 2 / alpha^2 - 2. Cycles samples it wrongly: no form may use it
  DiffuseToon,
  GlossyToon,
};

/// The name in the command line and in the conformance tests.
const char* name_of(LobeKind);
/// Throws InputError that lists the known names.
LobeKind lobe_named(const std::string&);

/// A closure with its settings, in double precision. Settings that its kind does not take are ignored.
struct Lobe {
  LobeKind kind = LobeKind::Diffuse;
  Rgb<double> weight{1, 1, 1};              ///< factor of all that it scatters
  Vec3<double> normal{0, 0, 1};             ///< unit
  std::array<Rgb<double>, kRampSize> ramp;  ///< DiffuseRamp, PhongRamp
  double exponent = 1;                      ///< PhongRamp
  Vec3<double> tangent{1, 0, 0};            ///< microfacets; need not be perpendicular to the normal
  double alpha_x = 0.5, alpha_y = 0.5;      ///< microfacets: roughness along the tangent and across it, in (0, 1]
  double roughness = 0;                     ///< Burley, OrenNayar, Velvet: from 0 to 1
  Rgb<double> albedo{0, 0, 0};              ///< OrenNayar: albedo of the facets, from 0 to 1
  double size = 0.5, smooth = 0;            ///< toons: in units of 90 degrees, from 0 to 1
};

/// f cos(theta_i) with its weight; 0 for delta closures. Directions must be above the surface.
Rgb<double> evaluate(const Lobe&, const Vec3<double>& wi, const Vec3<double>& wo);

}  // namespace brdfc::inline closures
