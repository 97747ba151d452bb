// SPDX-License-Identifier: GPL-3.0-or-later
// Checks that nothing is NaN, infinite or negative, that sampled directions are unit vectors, and that no light is
// scattered below the surface.
#include "check/claim.h"
#include "measure/bound_model.h"
#include "measure/probes.h"

namespace brdfc::check {
namespace {

/// Evaluates every function of a model at a pair of directions. Throws ValueError at the first invalid value.
void require_values(const Case& c, const Vec3<double>& wi, const Vec3<double>& wo, measure::Random& random) {
  const Brdf<double>& f = *c.bound.brdf;
  const Brdf<float>& single = *c.single;
  const std::string& label = c.bound.label;
  measure::require_value(f.eval(wi, wo), "f", label, wi, wo);
  measure::require_value(f.pdf(wi, wo), "pdf", label, wi, wo);
  const Vec3<float> fi = Vec3<float>::from(wi), fo = Vec3<float>::from(wo);
  measure::require_value(measure::to_double(single.eval(fi, fo)), "f in float", label, wi, wo);
  measure::require_value(double(single.pdf(fi, fo)), "pdf in float", label, wi, wo);
  for (const double stiff : {0., 0.25, 0.5, measure::uniform(random), 1 - 0x1p-24}) {
    const Vec3<double> u{measure::uniform(random), random() & 1 ? stiff : measure::uniform(random),
                         random() & 1 ? stiff : measure::uniform(random)};
    const Sample<double> s = f.sample(wo, u);
    measure::require_value(s.weight, "weight", label, s.wi, wo);
    measure::require_value(s.pdf, "pdf", label, s.wi, wo);
    const Sample<float> t = single.sample(fo, Vec3<float>::from(u));
    measure::require_value(measure::to_double(t.weight), "weight in float", label, measure::to_double(t.wi), wo);
    measure::require_value(double(t.pdf), "pdf in float", label, measure::to_double(t.wi), wo);
  }
  measure::require_value(f.mirror(wo), "mirror", label, wi, wo);
  measure::require_value(measure::to_double(single.mirror(fo)), "mirror in float", label, wi, wo);
  measure::require_value(f.transmit(wo), "transmit", label, wi, wo);
  measure::require_value(measure::to_double(single.transmit(fo)), "transmit in float", label, wi, wo);
  const double far = std::pow(10, 12 * measure::uniform(random) - 6);
  for (const double distance : {0., measure::uniform(random), far}) {
    measure::require_value(f.transmittance(distance), "transmittance", label, wi, wo);
    measure::require_value(measure::to_double(single.transmittance(float(distance))), "transmittance in float", label,
                           wi, wo);
  }
}

void values(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    measure::Random random = t.random(c, Purpose::Values);
    const Brdf<double>& f = *c.bound.brdf;
    for (const auto& [wi, wo] : measure::direction_pairs(f, t.scaled(256), random, measure::two_sided(t.model(), f))) {
      try {
        require_values(c, wi, wo, random);
        verdict.add(0, c.bound.label);
      } catch (const ValueError& e) {
        verdict.add(1, e.what());
      }
    }
  });
}

void unit(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    measure::Random random = t.random(c, Purpose::Length);
    for (int k = 0; k < t.scaled(64); ++k) {
      Vec3<double> wo = measure::uniform_direction(random);
      const Vec3<double> u = measure::uniform_cube(random);
      if (measure::two_sided(t.model(), *c.bound.brdf) && k % 2 == 1) wo.z = -wo.z;
      const Sample<double> s = c.bound.brdf->sample(wo, u);
      if (!(s.pdf > 0)) continue;
      verdict.add(std::abs(length(s.wi) - 1), fmt::format("{} wo={} u={}: sample() gives wi={}", c.bound.label,
                                                          measure::text(wo), measure::text(u), measure::text(s.wi)));
    }
  });
}

/// The largest of f, the pdf, and the pdf of a sampled direction, with one of the directions below the surface.
void horizon(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    const Brdf<double>& f = *c.bound.brdf;
    if (measure::two_sided(t.model(), f)) return;
    measure::Random random = t.random(c, Purpose::Horizon);
    const auto judge = [&](double value, const char* what, const Vec3<double>& wi, const Vec3<double>& wo) {
      verdict.add(value, fmt::format("{} {}(wi={}, wo={})", c.bound.label, what, measure::text(wi), measure::text(wo)));
    };
    const auto below = [](const Vec3<double>& w) { return Vec3<double>{w.x, w.y, -w.z}; };
    for (const auto& [i, o] : measure::direction_pairs(f, t.scaled(64), random)) {
      for (const auto& [wi, wo] : {std::pair{below(i), o}, std::pair{i, below(o)}, std::pair{below(i), below(o)}}) {
        judge(max_component(magnitude(f.eval(wi, wo))), "f", wi, wo);
        judge(std::abs(f.pdf(wi, wo)), "pdf", wi, wo);
      }
      for (const Vec3<double>& wo : {o, below(o)}) {
        const Sample<double> s = f.sample(wo, measure::uniform_cube(random));
        if (!(s.wi.z > 0 && wo.z > 0)) judge(s.pdf, "sample()'s pdf", s.wi, wo);
      }
    }
  });
}

/// Tolerance of a direction's length: rounding in double precision, where a direction may be computed through several
/// others.
constexpr double kUnit = 1e-9;

}  // namespace

std::vector<Check> value_checks() {
  std::vector<Check> checks = {
      {"values", "no bad one: f, pdf, weights finite and >= 0, in float and double", at_most(0), values},
      {"unit directions", "sample() gives unit vectors", at_most(kUnit), unit, without_lobe},
      {"horizon", "f = pdf = 0 unless wi and wo are above the surface", at_most(0), horizon, without_upper_lobe}};
  for (Check& check : checks) check.vital = true;
  return checks;
}

}  // namespace brdfc::check
