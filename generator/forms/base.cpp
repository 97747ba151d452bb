// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/base.h"

#include <algorithm>
#include <cmath>

#include "core/sequence.h"
#include "forms/aimed.h"
#include "measure/bound_model.h"

namespace brdfc::forms {
namespace {

double mean(const Rgb<double>& c) { return (c.r + c.g + c.b) / 3; }
/// A smooth sky without symmetry, 1 on average over all directions.
double sky(const Vec3<double>& w) {
  const Vec3<double> brightest = {0.48, 0.6, 0.64};
  return 1 + 0.9 * dot(brightest, w);
}

/// Mean and variance of one channel.
struct Moments1 {
  Rgb<double> sum{0, 0, 0}, sum2{0, 0, 0};
  void add(const Rgb<double>& v) {
    sum += v;
    sum2 += v * v;
  }
  double variance(double n) const { return std::max(0., mean(sum2 / n - (sum / n) * (sum / n))); }
};

}  // namespace

BaseWorth base_worth(const measure::BoundModel& bound, const Vec3<double>& wo, int points) {
  const Brdf<double>& brdf = *bound.brdf;
  const ClosureSum<double> base = brdf.base(wo);
  for (const Closure<double>& c : base)
    measure::require_value(c.weight, "weight of the base", bound.label, c.normal, wo);

  Moments1 white_drawn, white_rest, sky_drawn, sky_rest;
  Rgb<double> lacking(0.0), of_base(0.0), both(0.0), base2(0.0);
  double largest = 0;
  Sequence3 sequence(7);
  for (int i = 0; i < points; ++i) {
    const Vec3<double> u = sequence.next();
    const Sample<double> drawn = brdf.sample(wo, u);
    white_drawn.add(drawn.weight);
    sky_drawn.add(drawn.weight * sky(drawn.wi));

    const Vec3<double> wi = draw(brdf, base, wo, u);
    if (wi.z <= 0) {
      white_rest.add(Rgb<double>(0.0));
      sky_rest.add(Rgb<double>(0.0));
      continue;
    }
    const Rgb<double> of_closures = evaluate(base, wi, wo);
    const Excess<double> e = excess(brdf, base, wi, wo);
    const Rgb<double> b = of_closures / e.density, rest = e.value / e.density, f = rest + b;
    measure::require_value(b, "base", bound.label, wi, wo);
    white_rest.add(rest);
    sky_rest.add(rest * sky(wi));
    lacking += magnitude(rest);
    of_base += b;
    both += b * f;
    base2 += b * b;
    largest = std::max(largest, mean(magnitude(rest)));
  }
  const double n = points, albedo = mean(white_drawn.sum) / n;
  BaseWorth out;
  if (albedo <= 0) return out;
  out.relative_l1 = mean(lacking) / n / albedo;
  out.share = mean(of_base) / n / albedo;
  out.best_scale = mean(base2) > 0 ? mean(both) / mean(base2) : 0;
  out.white_drawn = white_drawn.variance(n) / sqr(albedo);
  out.white_rest = white_rest.variance(n) / sqr(albedo);
  out.sky_drawn = sky_drawn.variance(n) / sqr(albedo);
  out.sky_rest = sky_rest.variance(n) / sqr(albedo);
  out.largest = largest / albedo;
  return out;
}

}  // namespace brdfc::forms
