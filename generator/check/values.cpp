// SPDX-License-Identifier: GPL-3.0-or-later
// Nothing is NaN, infinite or negative.
#include "check/claim.h"

namespace brdfc::checks {
namespace {

/// All that a model gives for a pair of directions; throws ValueError at the first bad value.
void require_values(const Case& c, const Vec3<double>& wi, const Vec3<double>& wo, Random& random) {
  const Brdf<double>& f = *c.bound.brdf;
  const Brdf<float>& single = *c.single;
  const std::string& label = c.bound.label;
  require_value(f.eval(wi, wo), "f", label, wi, wo);
  require_value(f.pdf(wi, wo), "pdf", label, wi, wo);
  const Vec3<float> fi = Vec3<float>::from(wi), fo = Vec3<float>::from(wo);
  require_value(to_double(single.eval(fi, fo)), "f in float", label, wi, wo);
  require_value(double(single.pdf(fi, fo)), "pdf in float", label, wi, wo);
  for (const double stiff : {0., 0.25, 0.5, uniform(random), 1 - 0x1p-24}) {
    const Vec3<double> u{uniform(random), random() & 1 ? stiff : uniform(random),
                         random() & 1 ? stiff : uniform(random)};
    const Sample<double> s = f.sample(wo, u);
    require_value(s.weight, "weight", label, s.wi, wo);
    require_value(s.pdf, "pdf", label, s.wi, wo);
    const Sample<float> t = single.sample(fo, Vec3<float>::from(u));
    require_value(to_double(t.weight), "weight in float", label, to_double(t.wi), wo);
    require_value(double(t.pdf), "pdf in float", label, to_double(t.wi), wo);
  }
  require_value(f.mirror(wo), "mirror", label, wi, wo);
  require_value(to_double(single.mirror(fo)), "mirror in float", label, wi, wo);
  require_value(f.transmit(wo), "transmit", label, wi, wo);
  require_value(to_double(single.transmit(fo)), "transmit in float", label, wi, wo);
  const double far = std::pow(10, 12 * uniform(random) - 6);
  for (const double distance : {0., uniform(random), far}) {
    require_value(f.transmittance(distance), "transmittance", label, wi, wo);
    require_value(to_double(single.transmittance(float(distance))), "transmittance in float", label, wi, wo);
  }
}

void values(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    Random random = t.random(c, Purpose::Values);
    const Brdf<double>& f = *c.bound.brdf;
    for (const auto& [wi, wo] : direction_pairs(f, t.scaled(256), random, two_sided(t.model(), f))) {
      try {
        require_values(c, wi, wo, random);
        verdict.add(0, c.bound.label);
      } catch (const ValueError& e) {
        verdict.add(1, e.what());
      }
    }
  });
}

}  // namespace

std::vector<Check> value_checks() {
  return {{"values", "no bad one: f, pdf, weights finite and >= 0, in float and double", at_most(0), values}};
}

}  // namespace brdfc::checks
