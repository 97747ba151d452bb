// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/checks.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <functional>
#include <limits>
#include <mutex>
#include <sstream>

#include "analysis/properties.h"
#include "analysis/stability.h"
#include "core/parallel.h"
#include "model/sampling.h"

namespace brdfc {
namespace {

// Limits. An identity of formulas is tested in Wide, where only constants written in double precision round.
constexpr double kIdentity = 1e-12;
// Reciprocity in double: swapping only reorders operations.
constexpr double kReciprocity = 1e-9;
// A sum of closures that equals the model: as published, closures are exact to rounding.
constexpr double kExact = 1e-12;
// Quadrature's own error is added to these two.
constexpr double kAlbedo = 1e-6;
constexpr double kNormalisation = 1e-6;
// A property declared absent must visibly be.
constexpr double kVisible = 1e-3;
// A jump of a derivative that is rounding or a curvature, and one that the eye sees as an edge.
constexpr double kSmooth = 1e-3;
constexpr double kEdge = 1e-2;
// Weights or values that are equal but for rounding.
constexpr double kEven = 1e-6;
// Share of the light near ideal reflection that makes a mirror.
constexpr double kMirror = 0.99;
// Rounding errors a good formula may add to those of its inputs, in units of them.
constexpr double kAmplified = 32;
constexpr double kSignificance = 0.01;
constexpr AlbedoOptions kAlbedoOptions{.absolute = 1e-7, .max_cells = 4000, .witnesses = 1 << 16};

/// Gathers the worst of many cases that run in parallel.
class Worst {
 public:
  Worst(const Model& model, std::string check, std::string expected) {
    row_.model = model.info().name;
    row_.check = std::move(check);
    row_.expected = std::move(expected);
    row_.worst = -std::numeric_limits<double>::infinity();
  }
  /// `value` passes if it is at most `limit`. Among several the one with the largest excess is kept.
  void add(double value, double limit, const std::string& where) {
    const std::lock_guard lock(mutex_);
    ++row_.cases;
    const bool passed = value <= limit;  // a NaN fails
    const double excess = value - limit;
    if (!(excess <= excess_)) {
      excess_ = excess;
      row_.worst = value;
      row_.limit = limit;
      row_.where = where;
    }
    row_.passed = row_.passed && passed;
  }
  void skip() {
    const std::lock_guard lock(mutex_);
    ++row_.skipped;
  }
  CheckRow row() const {
    CheckRow r = row_;
    if (r.cases == 0) r.worst = 0, r.passed = false, r.where = "no case could be judged";
    return r;
  }

 private:
  CheckRow row_;
  double excess_ = -std::numeric_limits<double>::infinity();
  std::mutex mutex_;
};

/// "n=0 m=1" as values.
ParamValues parse_limit(const ModelInfo& info, const std::string& text) {
  std::vector<std::string> assignments;
  std::istringstream in(text);
  for (std::string one; in >> one;) assignments.push_back(one);
  return parse_values(info, assignments);
}

}  // namespace

ChiSquare chi_square(const BoundModel& bound, const Vec3<double>& wo, int samples, std::uint64_t seed) {
  const Brdf<double>& brdf = *bound.brdf;
  const Guides guides(brdf, wo, 8192);
  const auto draw = [&](Random& random, Point2& p) {
    const Sample<double> s = brdf.sample(wo, uniform_cube(random));
    require_value(s.pdf, "pdf", bound.label, s.wi, wo);
    if (!(s.pdf > 0)) return false;
    p = guides.angles(s.wi);
    return true;
  };
  // A tree of medians of pilot samples: cells of about equal probability.
  constexpr int kPilots = 4096, kDepth = 6;
  Random random(seed);
  std::vector<Point2> pilots;
  for (int i = 0; i < kPilots; ++i)
    if (Point2 p; draw(random, p)) pilots.push_back(p);
  struct Cell {
    Rect rect;
    std::vector<Point2> pilots;
  };
  std::vector<Cell> cells{{{0, brdf.scatters_through() ? kPi : kPi / 2, 0, 2 * kPi}, pilots}};
  for (int depth = 0; depth < kDepth; ++depth) {
    std::vector<Cell> halves;
    for (Cell& c : cells) {
      const bool split_x = depth % 2 == 0;
      std::sort(c.pilots.begin(), c.pilots.end(),
                [&](const Point2& a, const Point2& b) { return split_x ? a.x < b.x : a.y < b.y; });
      const std::size_t middle = c.pilots.size() / 2;
      const double at = c.pilots.size() < 2 ? (split_x ? 0.5 * (c.rect.x0 + c.rect.x1) : 0.5 * (c.rect.y0 + c.rect.y1))
                                            : (split_x ? c.pilots[middle].x : c.pilots[middle].y);
      if (split_x ? !(at > c.rect.x0 && at < c.rect.x1) : !(at > c.rect.y0 && at < c.rect.y1)) {
        halves.push_back(std::move(c));
        continue;
      }
      Cell a{c.rect, {}}, b{c.rect, {}};
      (split_x ? a.rect.x1 : a.rect.y1) = at;
      (split_x ? b.rect.x0 : b.rect.y0) = at;
      for (const Point2& p : c.pilots) ((split_x ? p.x : p.y) < at ? a : b).pilots.push_back(p);
      halves.push_back(std::move(a));
      halves.push_back(std::move(b));
    }
    cells = std::move(halves);
  }

  const Integrand2 density = [&](double theta, double phi, double* out) {
    const Vec3<double> wi = guides.direction_at(theta, phi);
    const double pdf = brdf.pdf(wi, wo);
    require_value(pdf, "pdf", bound.label, wi, wo);
    out[0] = pdf * std::sin(theta);
  };
  std::vector<double> expected;
  double total = 0, uncertain = 0;
  ChiSquare result;
  for (const Cell& c : cells) {
    // Twice, because what one mesh misses another does not.
    const auto probability = [&](std::size_t most) {
      return integrate(density, 1, guides.cells(c.rect, most), {1e-7, 0, 1500});
    };
    // An error of the expected counts must stay small beside their fluctuation. It only grows.
    const auto known = [&] { return uncertain * samples < 0.1 * std::sqrt(double(samples) / double(cells.size())); };
    const CubatureResult r = probability(4);
    uncertain += r.error[0];
    if (known()) uncertain += std::abs(r.value[0] - probability(16).value[0]);
    result.converged = known();
    if (!result.converged) break;
    expected.push_back(r.value[0] * samples);
    total += r.value[0];
  }
  if (!result.converged) {
    // Nothing to compare with, but bad values show.
    Point2 p;
    for (int i = 0; i < samples; ++i) draw(random, p);
    return result;
  }
  // Lost samples are the last cell.
  expected.push_back(std::max(0., 1 - total) * samples);
  std::vector<double> observed(expected.size(), 0.);
  for (int i = 0; i < samples; ++i) {
    Point2 p;
    if (!draw(random, p)) {
      ++observed.back();
      continue;
    }
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const Rect& r = cells[k].rect;
      if (p.x >= r.x0 && p.x < r.x1 && p.y >= r.y0 && p.y < r.y1) {
        ++observed[k];
        break;
      }
    }
  }
  std::vector<std::size_t> order(expected.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return expected[a] < expected[b]; });
  double pooled_expected = 0, pooled_observed = 0;
  int kept = 0;
  for (std::size_t j = 0; j < order.size(); ++j) {
    pooled_expected += expected[order[j]];
    pooled_observed += observed[order[j]];
    // A remainder too small for a cell of its own joins nothing: it is impossible or nearly so, and then must be empty.
    if (pooled_expected < 5 && j + 1 < order.size()) continue;
    if (pooled_expected > 0) result.statistic += sqr(pooled_observed - pooled_expected) / pooled_expected;
    ++kept;
    pooled_expected = pooled_observed = 0;
  }
  result.degrees = std::max(1, kept - 1);
  result.p = boost::math::cdf(boost::math::complement(boost::math::chi_squared(result.degrees), result.statistic));
  return result;
}

std::vector<CheckRow> check_model(const Model& model, const CheckOptions& options) {
  const ModelInfo& info = model.info();
  const ModelProperties& claims = info.properties;
  const std::uint64_t seed = options.seed;
  const auto scaled = [&](int n) { return std::max(1, int(std::lround(n * options.effort))); };
  // Those within the sliders' ranges come first: what a model declares of its lobe holds there.
  const std::vector<ParamValues> usual =
      thin_out(info, slider_cases(info, 3, seed), std::size_t(std::max(6, scaled(16))));
  std::vector<ParamValues> cases = usual;
  for (const ParamValues& v : thin_out(info, end_cases(info, false), std::size_t(std::max(4, scaled(16)))))
    cases.push_back(v);
  std::vector<BoundModel> bound;
  for (const ParamValues& v : cases) bound.push_back(bind_model(model, v));
  // Quadrature and histograms cost most: they take every second or third case.
  const std::size_t stride = std::max<std::size_t>(1, cases.size() / std::size_t(scaled(12)));
  const auto random_of = [&](std::size_t i, std::uint64_t what) { return Random(seed * 7919 + i * 101 + what); };

  Worst values(model, "values", "f, pdf, weights finite and >= 0, in float and double");
  Worst above(model, "conserving", "albedo <= 1 + error");
  Worst exceeds(model, "not conserving", "albedo > 1 somewhere");
  Worst lossless(model, "lossless", "|albedo - 1| <= error with colours at 1");
  Worst lossy(model, "not lossless", "albedo differs from 1 somewhere with colours at 1");
  Worst reciprocal(model, "reciprocal", "f(wi, wo) = f(wo, wi)");
  Worst one_way(model, "not reciprocal", "f(wi, wo) differs from f(wo, wi) somewhere");
  Worst isotropic(model, "isotropic", "f unchanged when both directions turn");
  Worst turned(model, "not isotropic", "f changes somewhere when both directions turn");
  Worst positive(model, "positive", "f > 0 above the surface, underflow aside");
  Worst dark(model, "not positive", "f = 0 somewhere, not by underflow");
  Worst smooth(model, "smooth", "no jump of a derivative of f");
  Worst edged(model, "not smooth", "a derivative of f jumps visibly somewhere");
  Worst even(model, "exact sampling", "the weight does not depend on wi");
  Worst uneven(model, "not exact sampling", "the weight depends on wi somewhere");
  Worst matte(model, "diffuse limit", "f constant at " + claims.diffuse_limit);
  Worst never_matte(model, "no diffuse limit", "f not constant at any end of a range");
  Worst mirror_like(model, "specular limit", "share away from ideal reflection at " + claims.specular_limit);
  Worst never_mirror(model, "no specular limit", "light leaves elsewhere at every end of a range");
  Worst normalised(model, "pdf integral", "integral of pdf + lost samples = 1");
  Worst weights(model, "sample weight", "weight pdf = f cos, sample's pdf = pdf()");
  Worst mean(model, "sampled albedo", "mean weight = albedo by quadrature");
  Worst histogram(model, "chi-square", "p > 0.01 over all cases (Sidak)");
  Worst exact(model, "exact closures", "relative L1 of f cos, and the weights of delta terms");
  Worst single(model, "float rounding", "error of f / error its inputs' rounding causes");
  Worst twice(model, "double rounding", "error of f / error its inputs' rounding causes");

  // Extremes first found here, judged after the loop.
  std::mutex mutex;
  double most = 0, off = 0, largest_swap = 0, largest_turn = 0, largest_spread = 0, sharpest = 0;
  double flattest = std::numeric_limits<double>::infinity(), most_mirror = 0, variance = 0;
  std::string dark_at, sharpest_at = "largest jump", flattest_at, mirror_at, variance_at;
  const bool scatters = model.has_scatter();
  std::vector<std::pair<ChiSquare, std::string>> histograms;

  for_all(cases.size(), [&](std::size_t i) {
    const BoundModel& b = bound[i];
    const Brdf<double>& f = *b.brdf;
    const bool within = i < usual.size(), thorough = i % stride == 0;
    const auto single_precision = model.make_float(cases[i]);
    const auto wide = model.make_wide(cases[i]);

    {  // values
      Random random = random_of(i, 1);
      for (const auto& [wi, wo] : direction_pairs(f, scaled(256), random, two_sided(model, f))) {
        require_value(f.eval(wi, wo), "f", b.label, wi, wo);
        require_value(f.pdf(wi, wo), "pdf", b.label, wi, wo);
        const Vec3<float> fi = Vec3<float>::from(wi), fo = Vec3<float>::from(wo);
        require_value(to_double(single_precision->eval(fi, fo)), "f in float", b.label, wi, wo);
        require_value(double(single_precision->pdf(fi, fo)), "pdf in float", b.label, wi, wo);
        for (const double stiff : {0., 0.25, 0.5, uniform(random), 1 - 0x1p-24}) {
          const Vec3<double> u{uniform(random), random() & 1 ? stiff : uniform(random),
                               random() & 1 ? stiff : uniform(random)};
          const Sample<double> s = f.sample(wo, u);
          require_value(s.weight, "weight", b.label, s.wi, wo);
          require_value(s.pdf, "pdf", b.label, s.wi, wo);
          const Sample<float> t = single_precision->sample(fo, Vec3<float>::from(u));
          require_value(to_double(t.weight), "weight in float", b.label, to_double(t.wi), wo);
          require_value(double(t.pdf), "pdf in float", b.label, to_double(t.wi), wo);
        }
        require_value(f.mirror(wo), "mirror", b.label, wi, wo);
        require_value(to_double(single_precision->mirror(fo)), "mirror in float", b.label, wi, wo);
        require_value(f.transmit(wo), "transmit", b.label, wi, wo);
        require_value(to_double(single_precision->transmit(fo)), "transmit in float", b.label, wi, wo);
        const double far = std::pow(10, 12 * uniform(random) - 6);
        for (const double distance : {0., uniform(random), far}) {
          require_value(f.transmittance(distance), "transmittance", b.label, wi, wo);
          require_value(to_double(single_precision->transmittance(float(distance))), "transmittance in float", b.label,
                        wi, wo);
        }
        values.add(0, 0, b.label);
      }
    }
    {  // albedo by sampling: quick, to find the extremes
      ParamValues white = cases[i];
      for (const ParamInfo& p : info.params)
        if (p.kind == ParamKind::Color) white[p.name] = 1.;
      const BoundModel white_bound = bind_model(model, white);
      Random random = random_of(i, 2);
      const auto total = [&](const BoundModel& m, double cos_o, double phi) {
        return sampled_albedo(*m.brdf, cos_o, phi, m.label, scaled(2048)).scattered +
               m.brdf->mirror(direction(cos_o, phi)) + m.brdf->transmit(direction(cos_o, phi));
      };
      const auto precise = [&](const BoundModel& m, double cos_o, double phi) {
        return albedo(*m.brdf, cos_o, phi, m.label, kAlbedoOptions);
      };
      double highest = 0, highest_cos = 1, lowest = 2, lowest_cos = 1;
      const double phi = 2 * kPi * uniform(random);
      std::vector<double> cosines{1., 0.2 + 0.7 * uniform(random), 0.05};
      if (two_sided(model, f)) cosines.insert(cosines.end(), {-1., -0.2 - 0.7 * uniform(random)});
      for (const double cos_o : cosines) {
        const Rgb<double> t = total(white_bound, cos_o, phi);
        const double top = max_component(t), bottom = std::min({t.r, t.g, t.b});
        if (top > highest) highest = top, highest_cos = cos_o;
        if (bottom < lowest) lowest = bottom, lowest_cos = cos_o;
      }
      // Judged by quadrature: what sampling found worst, and for the thorough cases one more.
      const auto judge = [&](const BoundModel& m, double cos_o, bool is_white) {
        const std::string where = fmt::format("{} cos_theta_o={:.6g} phi_o={:.6g}", m.label, cos_o, phi);
        const Albedo a = precise(m, cos_o, phi);
        const Rgb<double> t = a.total();
        above.add(max_component(t), 1 + kAlbedo + a.error + table_error(info, cases[i]), where);
        const SampledAlbedo s = sampled_albedo(*m.brdf, cos_o, phi, m.label, std::max(1024, scaled(1 << 13)));
        const Rgb<double> d = a.scattered - s.scattered;
        mean.add(std::max({std::abs(d.r), std::abs(d.g), std::abs(d.b)}), kAlbedo + a.error + 7 * s.standard_error,
                 where);
        if (is_white)
          lossless.add(std::max({std::abs(t.r - 1), std::abs(t.g - 1), std::abs(t.b - 1)}), kAlbedo + a.error, where);
        const std::lock_guard lock(mutex);
        most = std::max(most, max_component(t) - a.error);
        if (is_white)
          off = std::max(off, std::max({std::abs(t.r - 1), std::abs(t.g - 1), std::abs(t.b - 1)}) - a.error);
      };
      const bool gains = highest > 1 + kVisible && !claims.conserving, loses = lowest < 1 - kVisible;
      if (thorough || highest > 1.01) judge(white_bound, highest_cos, true);
      if ((thorough && !claims.lossless) || (claims.lossless && loses)) judge(white_bound, lowest_cos, true);
      if (thorough && !gains) judge(b, 0.05 + 0.95 * uniform(random), false);
    }
    if (thorough && scatters) {  // density
      Random random = random_of(i, 9);
      const double cos_o = i % 3 == 0 ? 1 : i % 3 == 1 ? 0.2 + 0.7 * uniform(random) : 0.05;
      const Vec3<double> wo = direction(cos_o, 2 * kPi * uniform(random));
      const auto drawn = [&](int samples) {
        return sampled_albedo(f, cos_o, std::atan2(wo.y, wo.x), b.label, samples);
      };
      SampledAlbedo s = drawn(std::max(1024, scaled(1 << 13)));
      const auto integral = [&](int guides) {
        return integrate_hemisphere(
            f, wo, 1,
            [&](const Vec3<double>& wi, double* out) {
              out[0] = f.pdf(wi, wo);
              require_value(out[0], "pdf", b.label, wi, wo);
            },
            {1e-7, 0, 2000}, guides);
      };
      const CubatureResult p = integral(512);
      const CubatureResult q = p.converged ? integral(4096) : p;
      // A thin curved ridge is missed by one mesh and not by another: no judgement is possible over directions.
      const double moved = std::abs(p.value[0] - q.value[0]);
      if (p.converged && q.converged && moved < 1e-5) {
        const double certain = kNormalisation + q.error[0] + moved;
        // A loss rarer than one sample in those drawn shows only among more.
        if (s.lost_error == 0 && std::abs(q.value[0] + s.lost - 1) > certain) s = drawn(1 << 20);
        normalised.add(std::abs(q.value[0] + s.lost - 1), certain + 7 * s.lost_error,
                       fmt::format("{} wo={}", b.label, text(wo)));
      } else {
        normalised.skip();
      }
    }
    {  // symmetries
      Random random = random_of(i, 3);
      for (const auto& [wi, wo] : direction_pairs(f, scaled(128), random, two_sided(model, f))) {
        double d = 0;
        if (scatters) {
          // Up to the squared index, where light goes through.
          const double n2i = wi.z > 0 ? 1 : sqr(f.ior()), n2o = wo.z > 0 ? 1 : sqr(f.ior());
          d = relative(f.eval(wi, wo) * n2o, f.eval(wo, wi) * n2i);
          // High powers amplify the rounding of a half vector: then the formulas themselves are compared.
          if (d > kReciprocity) {
            const Vec3<Wide> a = Vec3<Wide>::from(wi), c = Vec3<Wide>::from(wo);
            d = relative(wide->eval(a, c) * Wide(n2o), wide->eval(c, a) * Wide(n2i));
          }
        } else {
          const Vec3<Wide> to = normalize(Vec3<Wide>::from(wo));
          Vec3<Wide> from{-to.x, -to.y, to.z};
          if ((wi.z > 0) != (wo.z > 0)) from = refract(to, wide->ior());
          if (from.z == 0) continue;  // beyond the critical angle
          d = relative(value_of(model, *wide, from, to), value_of(model, *wide, to, from));
        }
        reciprocal.add(d, kReciprocity, fmt::format("{} wi={} wo={}", b.label, text(wi), text(wo)));
        const std::lock_guard lock(mutex);
        largest_swap = std::max(largest_swap, d);
      }
      for (const auto& [wi, wo] : direction_pairs(f, 16, random, two_sided(model, f))) {
        const Wide angle(2 * kPi * uniform(random)), c = cos(angle), s = sin(angle);
        const Vec3<Wide> i0 = Vec3<Wide>::from(wi), o0 = Vec3<Wide>::from(wo);
        const Rgb<Wide> before = value_of(model, *wide, i0, o0);
        const Rgb<Wide> after = value_of(model, *wide, rotate_z(i0, c, s), rotate_z(o0, c, s));
        const double d = relative(before, after);
        isotropic.add(d, kIdentity, fmt::format("{} wi={} wo={}", b.label, text(wi), text(wo)));
        const std::lock_guard lock(mutex);
        largest_turn = std::max(largest_turn, d);
      }
    }
    if (scatters && !f.scatters_through()) {  // shape above the surface: where sliders lead, colours neither black nor
                                              // full; a declared failure may also show at a
                                              // slider's end
      Random random = random_of(i, 10);
      ParamValues inner = cases[i];
      for (const ParamInfo& p : info.params)
        if (p.kind == ParamKind::Color)
          for (double& c : std::get<std::array<double, 3>>(inner[p.name])) c = 0.1 + 0.8 * c;
      if (within || !claims.positive) {
        const auto place = find_dark_place(model, inner, scaled(256), random);
        positive.add(place ? 1 : 0, 0, place.value_or(""));
        const std::lock_guard lock(mutex);
        if (place) dark_at = *place;
      }
      if (within || !claims.smooth) {
        const Edge e = sharpest_edge(bind_model(model, inner), scaled(24), random);
        smooth.add(e.jump, kSmooth, e.where);
        const std::lock_guard lock(mutex);
        if (e.jump > sharpest) sharpest = e.jump, sharpest_at = e.where;
      }
      if (within)
        for (const double cos_o : {1., 0.2 + 0.7 * uniform(random), 0.05}) {
          const Vec3<double> wo = direction(cos_o, 2 * kPi * uniform(random));
          const Weights w = sampled_weights(b, wo, scaled(512), random);
          if (w.kept < 2) continue;
          const std::string where = fmt::format("{} wo={}", b.label, text(wo));
          even.add(w.spread, kEven, where);
          const std::lock_guard lock(mutex);
          largest_spread = std::max(largest_spread, w.spread);
          if (w.variance > variance) variance = w.variance, variance_at = where;
        }
      if (const auto u = unevenness(f, 128, random)) {
        const std::lock_guard lock(mutex);
        if (*u < flattest) flattest = *u, flattest_at = b.label;
      }
      if (const auto share = least_mirror_share(f, scaled(512), random)) {
        const std::lock_guard lock(mutex);
        if (*share > most_mirror) most_mirror = *share, mirror_at = b.label;
      }
    }
    if (scatters) {  // weights
      Random random = random_of(i, 4);
      for (int k = 0; k < scaled(24); ++k) {
        Vec3<double> wo = uniform_direction(random);
        const Vec3<double> u = uniform_cube(random);
        if (two_sided(model, f) && k % 2 == 1) wo.z = -wo.z;
        const Vec3<Wide> wide_wo = Vec3<Wide>::from(wo);
        const Sample<Wide> s = wide->sample(wide_wo, Vec3<Wide>::from(u));
        if (!(s.pdf > Wide(0))) continue;
        const std::string where = fmt::format("{} wo={} u={}", b.label, text(wo), text(u));
        const Rgb<Wide> value = wide->eval(s.wi, wide_wo) * Wide(abs(s.wi.z)), by_weight = s.weight * s.pdf;
        weights.add(std::max(relative(value, by_weight), relative(s.pdf, wide->pdf(s.wi, wide_wo))), kIdentity, where);
      }
    }
    if (thorough && scatters) {  // histogram
      Random random = random_of(i, 5);
      double cos_o = i % 4 == 0 ? 1 : 0.15 + 0.8 * uniform(random);
      if (two_sided(model, f) && i % 4 > 1) cos_o = -cos_o;
      const Vec3<double> wo = direction(cos_o, 2 * kPi * uniform(random));
      const ChiSquare c = chi_square(b, wo, std::max(10000, scaled(30000)), random());
      if (c.converged) {
        const std::lock_guard lock(mutex);
        histograms.emplace_back(
            c, fmt::format("{} wo={} statistic={:.4g} degrees={}", b.label, text(wo), c.statistic, c.degrees));
      } else {
        histogram.skip();
      }
    }
    // Closures may be known for some choices only, but then for every view direction.
    if (f.exact({0, 0, 1})) {
      Random random = random_of(i, 6);
      for (int k = 0; k < 4; ++k) {
        Vec3<double> wo = k == 0 ? direction(0.01, 1) : uniform_direction(random);
        if (two_sided(model, f) && k % 2 == 1) wo.z = -wo.z;
        const auto sum = f.exact(wo);
        if (!sum) throw ValueError(fmt::format("{}: expected closures for every view direction", b.label));
        double apart = 0, all = 0;
        for (int j = 0; j < 64; ++j) {
          const Vec3<double> wi = uniform_direction(random);
          const Rgb<double> got = evaluate(*sum, wi, wo), want = f.eval(wi, wo) * wi.z, d = got - want;
          apart += std::abs(d.r) + std::abs(d.g) + std::abs(d.b);
          all += want.r + want.g + want.b;
        }
        Rgb<double> mirror(0), transmit(0);
        for (const Closure<double>& c : *sum) {
          if (c.kind == ClosureKind::Reflection) mirror += c.weight;
          if (c.kind == ClosureKind::Refraction) transmit += c.weight;
        }
        exact.add(std::max({all > 0 ? apart / all : apart, relative(mirror, f.mirror(wo)),
                            relative(transmit, f.transmit(wo))}),
                  kExact, fmt::format("{} wo={}", b.label, text(wo)));
      }
    }
    {
      const Stability s = float_stability(model, cases[i], scaled(128), random_of(i, 7)());
      single.add(s.amplified, kAmplified,
                 fmt::format("{} (largest relative error {:.2g})", s.amplified_where, s.relative));
      const Stability d = double_stability(model, cases[i], scaled(48), random_of(i, 8)());
      twice.add(d.amplified, kAmplified,
                fmt::format("{} (largest relative error {:.2g})", d.amplified_where, d.relative));
    }
  });

  // One p per case; the smallest of m independent ones is below 1 - (1 - a)^(1/m) with probability a.
  const double threshold = 1 - std::pow(1 - kSignificance, 1. / double(std::max<std::size_t>(1, histograms.size())));
  for (const auto& [c, where] : histograms) histogram.add(-c.p, -threshold, where);
  exceeds.add(1 + kVisible - most, 0, "largest albedo less its error");
  lossy.add(kVisible - off, 0, "largest |albedo - 1| with colours at 1, less its error");
  one_way.add(kVisible - largest_swap, 0, "largest relative difference");
  turned.add(kVisible - largest_turn, 0, "largest relative difference");
  dark.add(dark_at.empty() ? 1 : 0, 0, dark_at.empty() ? "no such place was found" : dark_at);
  edged.add(kEdge - sharpest, 0, sharpest_at);
  uneven.add(kVisible - largest_spread, 0, "largest relative spread of the weight");
  never_matte.add(kVisible - flattest, 0, flattest_at);
  never_mirror.add(most_mirror, kMirror, mirror_at);
  Random random(seed);
  if (!claims.diffuse_limit.empty()) {
    const BoundModel b = bind_model(model, parse_limit(info, claims.diffuse_limit));
    const auto u = unevenness(*b.brdf, 1024, random);
    matte.add(u.value_or(1), kEven, u ? b.label : b.label + ": f is 0");
  }
  if (!claims.specular_limit.empty()) {
    const BoundModel b = bind_model(model, parse_limit(info, claims.specular_limit));
    const auto share = least_mirror_share(*b.brdf, 8192, random);
    mirror_like.add(1 - share.value_or(0), 1 - kMirror, share ? b.label : b.label + ": no light");
  }

  std::vector<CheckRow> rows{values.row()};
  rows.push_back(claims.conserving ? above.row() : exceeds.row());
  rows.push_back(claims.lossless ? lossless.row() : lossy.row());
  // A mirror term alone has no lobe to judge.
  rows.push_back(claims.reciprocal ? reciprocal.row() : one_way.row());
  rows.push_back(claims.isotropic ? isotropic.row() : turned.row());
  if (!claims.specular_limit.empty()) rows.push_back(mirror_like.row());
  if (scatters) {
    if (claims.specular_limit.empty()) rows.push_back(never_mirror.row());
    rows.push_back(claims.diffuse_limit.empty() ? never_matte.row() : matte.row());
    rows.push_back(claims.positive ? positive.row() : dark.row());
    rows.push_back(claims.smooth ? smooth.row() : edged.row());
    rows.push_back(claims.exact_sampling ? even.row() : uneven.row());
    rows.push_back(normalised.row());
    rows.push_back(weights.row());
    rows.push_back(mean.row());
    CheckRow chi = histogram.row();
    chi.worst = -chi.worst;
    chi.limit = -chi.limit;
    rows.push_back(chi);
  }
  if (model.has_exact()) rows.push_back(exact.row());
  rows.push_back(single.row());
  rows.push_back(twice.row());
  if (scatters)
    rows.push_back({.model = info.name,
                    .check = "sampling variance",
                    .expected = "none: a figure, the largest variance of f cos / pdf over its mean squared",
                    .cases = int(usual.size()),
                    .worst = variance,
                    .limit = std::numeric_limits<double>::max(),
                    .where = variance_at});
  return rows;
}

}  // namespace brdfc
