// SPDX-License-Identifier: GPL-3.0-or-later
// Checks f when directions are swapped or rotated.
#include "check/claim.h"
#include "measure/probes.h"
#include "model/sampling.h"

namespace brdfc::check {
namespace {

/// Tolerance of reciprocity: swapping only reorders operations.
constexpr double kReciprocity = 1e-9;

/// The relative difference of a lobe with swapped directions. For transmission f is compared up to the squared index.
double swapped(const Case& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  const Brdf<double>& f = *c.bound.brdf;
  const double n2i = wi.z > 0 ? 1 : sqr(f.ior()), n2o = wo.z > 0 ? 1 : sqr(f.ior());
  const double d = measure::relative(f.eval(wi, wo) * n2o, f.eval(wo, wi) * n2i);
  if (d <= kReciprocity) return d;
  // High powers amplify the rounding of a half vector. Near a critical angle so do the Fresnel equations, where the
  // length of a rounded direction is already too far from 1. In these cases the formulas are compared in a wider type,
  // for the unit vectors that the directions stand for.
  const Vec3<Wide> a = normalize(Vec3<Wide>::from(wi)), b = normalize(Vec3<Wide>::from(wo));
  return measure::relative(c.wide->eval(a, b) * Wide(n2o), c.wide->eval(b, a) * Wide(n2i));
}

/// The same for delta terms, along the path of light towards wo; each channel has its own path. Returns nullopt beyond
/// the critical angle.
std::optional<double> swapped_path(const Model& model, const Case& c, const Vec3<double>& wi, const Vec3<double>& wo) {
  const Vec3<Wide> to = normalize(Vec3<Wide>::from(wo));
  const std::array<Wide, 3> iors = c.wide->channel_iors();
  std::optional<double> worst;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    Vec3<Wide> from{-to.x, -to.y, to.z};
    if ((wi.z > 0) != (wo.z > 0)) from = refract(to, iors[channel]);
    if (from.z == 0) continue;
    const Rgb<Wide> alone(Wide(channel == 0), Wide(channel == 1), Wide(channel == 2));
    const double d = measure::relative(measure::value_of(model, *c.wide, from, to) * alone,
                                       measure::value_of(model, *c.wide, to, from) * alone);
    worst = std::max(worst.value_or(d), d);
  }
  return worst;
}

void reciprocal(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    if (is_compensated(t.info(), c.bound.values)) return;
    measure::Random random = t.random(c, Purpose::Reciprocity);
    const Brdf<double>& f = *c.bound.brdf;
    for (const auto& [wi, wo] : measure::direction_pairs(f, t.scaled(128), random, measure::two_sided(t.model(), f))) {
      const std::optional<double> d = t.model().has_scatter() ? swapped(c, wi, wo) : swapped_path(t.model(), c, wi, wo);
      if (d) verdict.add(*d, fmt::format("{} wi={} wo={}", c.bound.label, measure::text(wi), measure::text(wo)));
    }
  });
}

void isotropic(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    measure::Random random = t.random(c, Purpose::Isotropy);
    const Brdf<double>& f = *c.bound.brdf;
    for (const auto& [wi, wo] : measure::direction_pairs(f, 16, random, measure::two_sided(t.model(), f))) {
      const Wide angle(2 * kPi * measure::uniform(random)), cosine = cos(angle), sine = sin(angle);
      const Vec3<Wide> i0 = Vec3<Wide>::from(wi), o0 = Vec3<Wide>::from(wo);
      const Rgb<Wide> before = measure::value_of(t.model(), *c.wide, i0, o0);
      const Rgb<Wide> after =
          measure::value_of(t.model(), *c.wide, rotate_z(i0, cosine, sine), rotate_z(o0, cosine, sine));
      verdict.add(measure::relative(before, after),
                  fmt::format("{} wi={} wo={}", c.bound.label, measure::text(wi), measure::text(wo)));
    }
  });
}

}  // namespace

std::vector<Check> symmetry_checks(const ModelProperties& claims) {
  return {
      check_of(
          claims.reciprocal, "reciprocal", {"reciprocal", "f(wi, wo) = f(wo, wi)", at_most(kReciprocity), reciprocal},
          {"not reciprocal", "f(wi, wo) differs from f(wo, wi) somewhere", somewhere_at_least(kVisible), reciprocal}),
      check_of(
          claims.isotropic, "isotropic",
          {"isotropic", "f unchanged when both directions turn", at_most(kIdentity), isotropic},
          {"not isotropic", "f changes somewhere when both directions turn", somewhere_at_least(kVisible), isotropic})};
}

}  // namespace brdfc::check
