// SPDX-License-Identifier: GPL-3.0-or-later
#include "closures/closure.h"

namespace brdfc::inline closures {
namespace {

/// Linear interpolation of a ramp at a position in [0, 1]; positions outside get the colours at the ends.
Rgb<double> ramp_at(const std::array<Rgb<double>, kRampSize>& ramp, double position) {
  const double scaled = position * (kRampSize - 1);
  if (scaled <= 0) return ramp.front();
  if (scaled >= kRampSize - 1) return ramp.back();
  const auto i = std::size_t(scaled);
  const double offset = scaled - double(i);
  return ramp[i] * (1 - offset) + ramp[i + 1] * offset;
}

}  // namespace

Rgb<double> evaluate(const Closure<double>& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  return evaluate(c, wi, wo, [&](double position) { return ramp_at(c.ramp, position); });
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

}  // namespace brdfc::inline closures
