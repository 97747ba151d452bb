// SPDX-License-Identifier: GPL-3.0-or-later
// Checks sampled directions: their weights, their pdf, and that they are distributed according to it.
#include "check/chi_square.h"
#include "check/claim.h"
#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/cubature.h"
#include "measure/guides.h"
#include "measure/probes.h"
#include "measure/properties.h"

namespace brdfc::check {
namespace {

/// Tolerance of the pdf's integral; the quadrature's error estimate is added to it.
constexpr double kNormalisation = 1e-6;
/// Allowed difference between two quadrature meshes. If they differ more, one of them misses a thin curved ridge, and
/// an integral over directions can't be judged.
constexpr double kMeshes = 1e-5;
constexpr double kSignificance = 0.01;
/// With this variance a picture with 64 samples a pixel has an error of half the light, about as much as no picture at
/// all. The models here reach at most 5.3; a lobe that sample() ignores gives hundreds.
constexpr double kVariance = 16;

/// Calls f(weights, where) for three views of each case within the sliders' ranges.
template <class F> void for_each_view(const Trial& t, const F& f) {
  t.for_each([&](const Case& c) {
    if (!c.within || c.bound.brdf->scatters_through()) return;
    measure::Random random = t.random(c, Purpose::Spread);
    for (const double cos_o : {1., 0.2 + 0.7 * measure::uniform(random), 0.05}) {
      const Vec3<double> wo = direction(cos_o, 2 * kPi * measure::uniform(random));
      const measure::Weights w = measure::sampled_weights(c.bound, wo, t.scaled(512), random);
      if (w.kept >= 2) f(w, fmt::format("{} wo={}", c.bound.label, measure::text(wo)));
    }
  });
}

void even(const Trial& t, Verdict& verdict) {
  for_each_view(t, [&](const measure::Weights& w, const std::string& where) { verdict.add(w.spread, where); });
}

void variance(const Trial& t, Verdict& verdict) {
  for_each_view(t, [&](const measure::Weights& w, const std::string& where) { verdict.add(w.variance, where); });
}

void normalised(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    if (!c.thorough) return;
    const Brdf<double>& f = *c.bound.brdf;
    const std::string& label = c.bound.label;
    measure::Random random = t.random(c, Purpose::Density);
    const double cos_o = c.index % 3 == 0 ? 1 : c.index % 3 == 1 ? 0.2 + 0.7 * measure::uniform(random) : 0.05;
    const Vec3<double> wo = direction(cos_o, 2 * kPi * measure::uniform(random));
    const auto drawn = [&](int samples) {
      return measure::sampled_albedo(f, cos_o, std::atan2(wo.y, wo.x), label, samples);
    };
    measure::SampledAlbedo s = drawn(std::max(1024, t.scaled(1 << 13)));
    const auto integral = [&](int guides) {
      return measure::integrate_hemisphere(
          f, wo, 1,
          [&](const Vec3<double>& wi, double* out) {
            out[0] = f.pdf(wi, wo);
            measure::require_value(out[0], "pdf", label, wi, wo);
          },
          {1e-7, 0, 2000}, guides);
    };
    const measure::CubatureResult p = integral(512);
    const measure::CubatureResult q = p.converged ? integral(4096) : p;
    const double moved = std::abs(p.value[0] - q.value[0]);
    if (!p.converged || !q.converged || !(moved < kMeshes)) return verdict.skip();
    const double uncertain = q.error[0] + moved;
    // A loss rarer than one in the samples drawn appears only in a larger set.
    if (s.lost_error == 0 && std::abs(q.value[0] + s.lost - 1) > kNormalisation + uncertain) s = drawn(1 << 20);
    verdict.add(std::abs(q.value[0] + s.lost - 1), fmt::format("{} wo={}", label, measure::text(wo)),
                uncertain + 7 * s.lost_error);
  });
}

void weights(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    measure::Random random = t.random(c, Purpose::Weights);
    for (int k = 0; k < t.scaled(24); ++k) {
      Vec3<double> wo = measure::uniform_direction(random);
      const Vec3<double> u = measure::uniform_cube(random);
      if (measure::two_sided(t.model(), *c.bound.brdf) && k % 2 == 1) wo.z = -wo.z;
      const Vec3<Wide> wide_wo = Vec3<Wide>::from(wo);
      const Sample<Wide> s = c.wide->sample(wide_wo, Vec3<Wide>::from(u));
      if (!(s.pdf > Wide(0))) continue;
      const Rgb<Wide> value = c.wide->eval(s.wi, wide_wo) * Wide(abs(s.wi.z)), by_weight = s.weight * s.pdf;
      verdict.add(std::max(measure::relative(value, by_weight), measure::relative(s.pdf, c.wide->pdf(s.wi, wide_wo))),
                  fmt::format("{} wo={} u={}", c.bound.label, measure::text(wo), measure::text(u)));
    }
  });
}

void histogram(const Trial& t, Verdict& verdict) {
  struct Found {
    ChiSquare of;
    std::string where;
  };
  std::vector<Found> found;
  std::mutex mutex;
  t.for_each([&](const Case& c) {
    if (!c.thorough) return;
    measure::Random random = t.random(c, Purpose::Histogram);
    double cos_o = c.index % 4 == 0 ? 1 : 0.15 + 0.8 * measure::uniform(random);
    if (measure::two_sided(t.model(), *c.bound.brdf) && c.index % 4 > 1) cos_o = -cos_o;
    const Vec3<double> wo = direction(cos_o, 2 * kPi * measure::uniform(random));
    const int samples = std::max(10000, t.scaled(30000));
    ChiSquare of = chi_square(c.bound, wo, samples, random());
    // One case in a hundred of a right model gets here. With new and more samples it stands out again as rarely as any
    // other, so that right models are refused with a probability of 1e-4.
    if (of.converged && of.p < kSignificance) of = chi_square(c.bound, wo, 4 * samples, random());
    if (!of.converged) return verdict.skip();
    const std::lock_guard lock(mutex);
    found.push_back({of, fmt::format("{} wo={} statistic={:.4g} degrees={}", c.bound.label, measure::text(wo),
                                     of.statistic, of.degrees)});
  });
  // The smallest of m independent p-values is below p with probability 1 - (1 - p)^m.
  for (const Found& one : found) verdict.add(-std::expm1(double(found.size()) * std::log1p(-one.of.p)), one.where);
}

}  // namespace

std::vector<Check> sampling_checks(const ModelProperties& claims) {
  return {
      check_of(claims.exact_sampling, "exact_sampling",
               {"exact sampling", "the weight does not depend on wi", at_most(kEven), even, without_upper_lobe},
               {"not exact sampling", "the weight depends on wi somewhere", somewhere_at_least(kVisible), even,
                without_upper_lobe}),
      {"sampling variance", "variance of f cos / pdf over its mean squared", at_most(kVariance), variance,
       without_upper_lobe},
      {"pdf integral", "integral of pdf + lost samples = 1", at_most(kNormalisation), normalised, without_lobe},
      {"sample weight", "weight pdf = f cos, sample's pdf = pdf()", at_most(kIdentity), weights, without_lobe, true},
      {"chi-square", "p > 0.01 over all cases (Sidak), twice", at_least(kSignificance), histogram, without_lobe}};
}

}  // namespace brdfc::check
