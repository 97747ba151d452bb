// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the sum of Cycles closures that a model claims to equal.
#include "check/claim.h"
#include "measure/probes.h"

namespace brdfc::check {
namespace {

/// Closures whose formulas are those of the published model are exact up to rounding.
constexpr double kExact = 1e-12;

std::string without_closures(const Trial& t) { return t.model().has_exact() ? "" : "no closures equal the model"; }

/// The relative L1 difference of f cos, or the difference of the weights of delta terms if that is larger.
double apart(const Brdf<double>& f, const ClosureSum<double>& sum, const Vec3<double>& wo, measure::Random& random) {
  double apart = 0, all = 0;
  for (int j = 0; j < 64; ++j) {
    const Vec3<double> wi = measure::uniform_direction(random);
    const Rgb<double> got = evaluate(sum, wi, wo), want = f.eval(wi, wo) * wi.z, d = got - want;
    apart += std::abs(d.r) + std::abs(d.g) + std::abs(d.b);
    all += want.r + want.g + want.b;
  }
  Rgb<double> mirror(0), transmit(0);
  for (const Closure<double>& c : sum) {
    if (c.kind == ClosureKind::Reflection) mirror += c.weight;
    if (c.kind == ClosureKind::Refraction) transmit += c.weight;
  }
  return std::max({all > 0 ? apart / all : apart, measure::relative(mirror, f.mirror(wo)),
                   measure::relative(transmit, f.transmit(wo))});
}

void exact(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    const Brdf<double>& f = *c.bound.brdf;
    // A model may have closures for some choices only; for these it must have them at every view direction.
    if (!f.exact({0, 0, 1})) return;
    measure::Random random = t.random(c, Purpose::Closures);
    for (int k = 0; k < 4; ++k) {
      Vec3<double> wo = k == 0 ? direction(0.01, 1) : measure::uniform_direction(random);
      if (measure::two_sided(t.model(), f) && k % 2 == 1) wo.z = -wo.z;
      const auto sum = f.exact(wo);
      if (!sum)
        throw ValueError(
            fmt::format("{} wo={}: expected closures for every view direction", c.bound.label, measure::text(wo)));
      verdict.add(apart(f, *sum, wo, random), fmt::format("{} wo={}", c.bound.label, measure::text(wo)));
    }
  });
}

}  // namespace

std::vector<Check> closure_checks() {
  return {{"exact closures", "relative L1 of f cos, and the weights of delta terms", at_most(kExact), exact,
           without_closures}};
}

}  // namespace brdfc::check
