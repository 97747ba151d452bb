// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the albedo: the share of light that leaves the surface.
#include <algorithm>

#include "check/claim.h"
#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "measure/probes.h"

namespace brdfc::check {
namespace {

/// Tolerance of albedos; the quadrature's error estimate is added to it.
constexpr double kAlbedo = 1e-6;
constexpr measure::AlbedoOptions kAlbedoOptions{.absolute = 1e-7, .max_cells = 4000, .witnesses = 1 << 16};
/// Allowed deviation of a mean of samples, in standard errors. It is large because thousands of means are checked.
constexpr double kStandardErrors = 7;

double off_one(const Rgb<double>& t) { return std::max({std::abs(t.r - 1), std::abs(t.g - 1), std::abs(t.b - 1)}); }

/// One view of a case; phi is the azimuth of the view.
AlbedoFound measure(const Trial& t, const Case& c, const measure::BoundModel& m, double cos_o, double phi, bool white) {
  const measure::Albedo a = measure::albedo(*m.brdf, cos_o, phi, m.label, kAlbedoOptions);
  const auto drawn = [&](int samples) { return measure::sampled_albedo(*m.brdf, cos_o, phi, m.label, samples); };
  measure::SampledAlbedo s = drawn(std::max(1024, t.scaled(1 << 13)));
  const auto difference = [&] {
    const Rgb<double> d = a.scattered - s.scattered;
    return std::max({std::abs(d.r), std::abs(d.g), std::abs(d.b)});
  };
  // An event rarer than one in the samples drawn appears only in a larger set, and their standard error does not
  // include it.
  if (difference() > kAlbedo + a.error + kStandardErrors * s.standard_error) s = drawn(1 << 20);
  return {max_component(a.total()),
          off_one(a.total()),
          a.error,
          table_error(t.info(), c.bound.values),
          difference(),
          s.standard_error,
          white,
          is_compensated(t.info(), c.bound.values),
          fmt::format("{} cos_theta_o={:.6g} phi_o={:.6g}", m.label, cos_o, phi)};
}

/// Sampling is fast and finds, with all colours at 1, the views with the highest and the lowest albedo. Quadrature then
/// measures these, and one more view for the thorough cases.
std::vector<AlbedoFound> albedos_of(const Trial& t, const Case& c) {
  const Brdf<double>& f = *c.bound.brdf;
  ParamValues white = c.bound.values;
  for (const ParamInfo& p : t.info().params)
    if (p.kind == ParamKind::Color) white[p.name] = 1.;
  const measure::BoundModel white_bound = measure::bind_model(t.model(), white);
  measure::Random random = t.random(c, Purpose::Albedo);
  double highest = 0, highest_cos = 1, lowest = 2, lowest_cos = 1;
  const double phi = 2 * kPi * measure::uniform(random);
  std::vector<double> cosines{1., 0.2 + 0.7 * measure::uniform(random), 0.05};
  if (measure::two_sided(t.model(), f)) cosines.insert(cosines.end(), {-1., -0.2 - 0.7 * measure::uniform(random)});
  for (const double cos_o : cosines) {
    const Rgb<double> sum =
        measure::sampled_albedo(*white_bound.brdf, cos_o, phi, white_bound.label, t.scaled(2048)).scattered +
        white_bound.brdf->mirror(direction(cos_o, phi)) + white_bound.brdf->transmit(direction(cos_o, phi));
    const double top = max_component(sum), bottom = std::min({sum.r, sum.g, sum.b});
    if (top > highest) highest = top, highest_cos = cos_o;
    if (bottom < lowest) lowest = bottom, lowest_cos = cos_o;
  }
  const bool gains = highest > 1 + kVisible && !t.claims().conserving, loses = lowest < 1 - kVisible;
  std::vector<AlbedoFound> found;
  if (c.thorough || highest > 1.01) found.push_back(measure(t, c, white_bound, highest_cos, phi, true));
  if (t.claims().lossless ? loses : c.thorough) found.push_back(measure(t, c, white_bound, lowest_cos, phi, true));
  if (c.thorough && !gains) found.push_back(measure(t, c, c.bound, 0.05 + 0.95 * measure::uniform(random), phi, false));
  return found;
}

void conserving(const Trial& t, Verdict& verdict) {
  for (const AlbedoFound& a : t.albedos())
    if (!a.compensated) verdict.add(a.highest, a.where, kAlbedo + a.error + a.table_error);
}

void gaining(const Trial& t, Verdict& verdict) {
  for (const AlbedoFound& a : t.albedos()) verdict.add(a.highest, a.where, a.error);
}

void lossless(const Trial& t, Verdict& verdict) {
  for (const AlbedoFound& a : t.albedos())
    if (a.white) verdict.add(a.off_one, a.where, a.error);
}

void sampled(const Trial& t, Verdict& verdict) {
  for (const AlbedoFound& a : t.albedos())
    verdict.add(a.difference, a.where, a.error + kStandardErrors * a.sample_error);
}

}  // namespace

const std::vector<AlbedoFound>& Trial::albedos() const {
  if (albedos_.empty()) {
    std::vector<std::vector<AlbedoFound>> found(cases_.size());
    for_each([&](const Case& c) { found[c.index] = albedos_of(*this, c); });
    for (const auto& of_case : found) albedos_.insert(albedos_.end(), of_case.begin(), of_case.end());
  }
  return albedos_;
}

std::vector<Check> energy_checks(const ModelProperties& claims) {
  return {check_of(claims.conserving, "conserving", {"conserving", "albedo <= 1 + error", at_most(1), conserving},
                   {"not conserving", "albedo > 1 somewhere", somewhere_at_least(1 + kVisible), gaining}),
          check_of(claims.lossless, "lossless",
                   {"lossless", "|albedo - 1| <= error with colours at 1", at_most(kAlbedo), lossless},
                   {"not lossless", "albedo differs from 1 somewhere with colours at 1", somewhere_at_least(kVisible),
                    lossless}),
          {"sampled albedo", "mean weight = albedo by quadrature", at_most(kAlbedo), sampled, without_lobe}};
}

}  // namespace brdfc::check
