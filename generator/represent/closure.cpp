// SPDX-License-Identifier: GPL-3.0-or-later
#include "represent/closure.h"

#include "core/error.h"

namespace brdfc {
namespace {

/// Linear look-up of a ramp at a position in [0, 1]; positions outside take the end entries.
Rgb<double> ramp_at(const std::array<Rgb<double>, kRampSize>& ramp, double position) {
  const double scaled = position * (kRampSize - 1);
  if (scaled <= 0) return ramp.front();
  if (scaled >= kRampSize - 1) return ramp.back();
  const auto i = std::size_t(scaled);
  const double offset = scaled - double(i);
  return ramp[i] * (1 - offset) + ramp[i + 1] * offset;
}

/// Smith's Lambda.
double lambda(ClosureKind kind, double alpha_x, double alpha_y, const Vec3<double>& v) {
  const double a2 = (sqr(alpha_x * v.x) + sqr(alpha_y * v.y)) / sqr(v.z);
  if (kind == ClosureKind::Ggx) return a2 / (2 * (std::sqrt(1 + a2) + 1));
  // Walter's rational fit, which leaves out all shadowing below a2 = 0.39.
  if (a2 < 0.39) return 0;
  const double a = 1 / std::sqrt(a2);
  return ((0.396 * a - 1.259) * a + 1) / ((2.181 * a + 3.535) * a);
}

}  // namespace

double microfacet(ClosureKind kind, double alpha_x, double alpha_y, const Vec3<double>& wi, const Vec3<double>& wo) {
  const Vec3<double> h = normalize(wi + wo);
  const double t2 = sqr(h.x / alpha_x) + sqr(h.y / alpha_y), z2 = sqr(h.z);
  const double D = kind == ClosureKind::Ggx ? kInvPi / (alpha_x * alpha_y * sqr(t2 + z2))
                                            : kInvPi * std::exp(-t2 / z2) / (alpha_x * alpha_y * sqr(z2));
  return D / (4 * wo.z * (1 + lambda(kind, alpha_x, alpha_y, wi) + lambda(kind, alpha_x, alpha_y, wo)));
}

Rgb<double> evaluate(const Closure<double>& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  const double cosTheta_i = dot(c.normal, wi), cosTheta_o = dot(c.normal, wo);
  if (cosTheta_i <= 0) return Rgb<double>(0.0);
  switch (c.kind) {
    case ClosureKind::Diffuse:
      return c.weight * (cosTheta_i * kInvPi);
    case ClosureKind::Burley:
      return c.weight * (cosTheta_i * kInvPi * (1 - pow5(1 - cosTheta_i) / 2) * (1 - pow5(1 - cosTheta_o) / 2));
    case ClosureKind::DiffuseRamp:
      return c.weight * ramp_at(c.ramp, cosTheta_i) * kInvPi;
    case ClosureKind::PhongRamp: {
      if (cosTheta_o <= 0) return Rgb<double>(0.0);
      const Vec3<double> r = c.normal * (2 * cosTheta_o) - wo;
      const double cosAlpha = dot(r, wi);
      if (cosAlpha <= 0) return Rgb<double>(0.0);
      const double lobe = std::pow(cosAlpha, c.exponent);
      return c.weight * ramp_at(c.ramp, lobe) * (cosTheta_i * (c.exponent + 2) * kInvPi / 2 * lobe);
    }
    case ClosureKind::Ggx:
    case ClosureKind::Beckmann: {
      if (cosTheta_o <= 0) return Rgb<double>(0.0);
      // Isotropic: only the heights and the angle between the directions matter.
      const Vec3<double> x = normalize(std::abs(c.normal.z) < 0.9 ? cross(c.normal, Vec3<double>{0, 0, 1})
                                                                  : cross(c.normal, Vec3<double>{0, 1, 0}));
      const Vec3<double> y = cross(c.normal, x);
      return c.weight * microfacet(c.kind, c.alpha, c.alpha, {dot(x, wi), dot(y, wi), cosTheta_i},
                                   {dot(x, wo), dot(y, wo), cosTheta_o});
    }
    case ClosureKind::Reflection:
    case ClosureKind::Refraction:
      return Rgb<double>(0.0);
  }
  throw InputError("closure of unknown kind");
}

Rgb<double> evaluate(const ClosureSum<double>& sum, const Vec3<double>& wi, const Vec3<double>& wo) {
  Rgb<double> total(0.0);
  for (const Closure<double>& c : sum) total += evaluate(c, wi, wo);
  return total;
}

int slots(ClosureKind kind) {
  switch (kind) {
    // A ramp stores 8 colours of 16 bytes in further slots of 96 bytes (bsdf_alloc, closure_alloc_extra).
    case ClosureKind::DiffuseRamp:
    case ClosureKind::PhongRamp:
      return 3;
    default:
      return 1;
  }
}

}  // namespace brdfc
