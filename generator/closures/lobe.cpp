// SPDX-License-Identifier: GPL-3.0-or-later
#include "closures/lobe.h"

#include <algorithm>
#include <iterator>

#include "core/error.h"

namespace brdfc::inline closures {
namespace {

constexpr std::pair<LobeKind, const char*> kNames[] = {
    {LobeKind::Diffuse, "diffuse"},          {LobeKind::Burley, "burley"},
    {LobeKind::OrenNayar, "oren_nayar"},     {LobeKind::Velvet, "velvet"},
    {LobeKind::DiffuseRamp, "diffuse_ramp"}, {LobeKind::PhongRamp, "phong_ramp"},
    {LobeKind::Reflection, "reflection"},    {LobeKind::Ggx, "ggx"},
    {LobeKind::Beckmann, "beckmann"},        {LobeKind::AshikhminShirley, "ashikhmin_shirley"},
    {LobeKind::DiffuseToon, "diffuse_toon"}, {LobeKind::GlossyToon, "glossy_toon"}};

/// v in the frame that Cycles builds from normal and tangent.
Vec3<double> in_frame(const Lobe& c, const Vec3<double>& v) {
  const Vec3<double> y = normalize(cross(c.normal, c.tangent)), x = cross(y, c.normal);
  return {dot(x, v), dot(y, v), dot(c.normal, v)};
}

/// f cos(theta_i) without weight. Directions are in the frame, above the surface.
double facets(const Lobe& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  if (c.kind == LobeKind::AshikhminShirley) {
    const Vec3<double> h = normalize(wi + wo);
    const double nu = 2 / sqr(c.alpha_x) - 2, nv = 2 / sqr(c.alpha_y) - 2;
    const double s2 = sqr(h.x) + sqr(h.y);
    // (h.n)^((nu hx^2 + nv hy^2) / (1 - (h.n)^2))
    const double e = s2 > 0 ? (nu * sqr(h.x) + nv * sqr(h.y)) / s2 : 0;
    const double lobe = std::exp(0.5 * e * std::log1p(-std::min(s2, 1.0)));
    return std::sqrt((nu + 1) * (nv + 1)) * kInvPi / 8 * lobe * wi.z / (dot(h, wo) * std::max(wi.z, wo.z));
  }
  return microfacet(c.kind == LobeKind::Ggx ? ClosureKind::Ggx : ClosureKind::Beckmann, c.alpha_x, c.alpha_y, wi, wo);
}

/// Evaluates a closure that forms use, with its definition in closure.h.
Rgb<double> used_by_forms(ClosureKind kind, const Lobe& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  Closure<double> closure(kind, c.weight);
  closure.normal = c.normal;
  closure.turned = true;
  closure.ramp = c.ramp;
  closure.exponent = c.exponent;
  closure.roughness = c.roughness;
  closure.albedo = c.albedo;
  closure.size = c.size;
  closure.smooth = c.smooth;
  return evaluate(closure, wi, wo);
}

}  // namespace

const char* name_of(LobeKind kind) {
  return std::find_if(std::begin(kNames), std::end(kNames), [&](const auto& n) { return n.first == kind; })->second;
}

LobeKind lobe_named(const std::string& name) {
  std::string known;
  for (const auto& [kind, text] : kNames) {
    if (name == text) return kind;
    known += (known.empty() ? "" : ", ") + std::string(text);
  }
  input_error("unknown closure '{}': expected one of {}", name, known);
}

Rgb<double> evaluate(const Lobe& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  const double cosTheta_i = dot(c.normal, wi), cosTheta_o = dot(c.normal, wo);
  switch (c.kind) {
    case LobeKind::Diffuse:
      return used_by_forms(ClosureKind::Diffuse, c, wi, wo);
    case LobeKind::Burley:
      return used_by_forms(ClosureKind::Burley, c, wi, wo);
    case LobeKind::OrenNayar:
      return used_by_forms(ClosureKind::OrenNayar, c, wi, wo);
    case LobeKind::Velvet:
      return used_by_forms(ClosureKind::Velvet, c, wi, wo);
    case LobeKind::DiffuseRamp:
      return used_by_forms(ClosureKind::DiffuseRamp, c, wi, wo);
    case LobeKind::PhongRamp:
      return used_by_forms(ClosureKind::PhongRamp, c, wi, wo);
    case LobeKind::Reflection:
      return used_by_forms(ClosureKind::Reflection, c, wi, wo);
    case LobeKind::Ggx:
    case LobeKind::Beckmann:
    case LobeKind::AshikhminShirley:
      if (cosTheta_i <= 0 || cosTheta_o <= 0) return Rgb<double>(0.0);
      return c.weight * facets(c, in_frame(c, wi), in_frame(c, wo));
    case LobeKind::DiffuseToon:
      return used_by_forms(ClosureKind::DiffuseToon, c, wi, wo);
    case LobeKind::GlossyToon:
      return used_by_forms(ClosureKind::GlossyToon, c, wi, wo);
  }
  throw InputError("closure of unknown kind");
}

}  // namespace brdfc::inline closures
