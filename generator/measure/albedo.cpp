// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "core/sequence.h"
#include "measure/bound_model.h"
#include "measure/guides.h"

namespace brdfc::measure {
namespace {

// Independent replicates of the sequence, for the error estimate. With 16 of them (t distribution with 15 degrees of
// freedom) an error of more than 7 standard errors is practically impossible.
constexpr int kReplicates = 16;

class AlbedoIntegrator {
 public:
  AlbedoIntegrator(const Brdf<double>& guide, const std::vector<const Brdf<double>*>& models, const Vec3<double>& wo,
                   const std::string& label)
      : guide_(guide), models_(models), wo_(wo), label_(label), n_(3 * models.size()) {}

  /// Evaluates f cos of every model.
  void evaluate(const Vec3<double>& wi, double* out) const {
    for (const Brdf<double>* m : models_) {
      const Rgb<double> f = m->eval(wi, wo_);
      require_value(f, "f", label_, wi, wo_);
      const double cosTheta = std::abs(wi.z);
      *out++ = f.r * cosTheta;
      *out++ = f.g * cosTheta;
      *out++ = f.b * cosTheta;
    }
  }

  CubatureResult over_directions(const CubatureOptions& options, int guides) const {
    return integrate_hemisphere(
        guide_, wo_, n_, [&](const Vec3<double>& wi, double* out) { evaluate(wi, out); }, options, guides);
  }

  /// The part of the guide's density that the cells of over_directions() miss; its accuracy is limited by the estimated
  /// share of lost samples.
  double missed_density(const CubatureOptions& options, int guides) const {
    const auto density = [&](const Vec3<double>& wi, double* out) {
      out[0] = guide_.pdf(wi, wo_);
      require_value(out[0], "pdf", label_, wi, wo_);
    };
    const SampledAlbedo drawn = sampled_albedo(guide_, wo_.z, std::atan2(wo_.y, wo_.x), label_);
    const double found = integrate_hemisphere(guide_, wo_, 1, density, options, guides).value[0];
    return std::max(std::abs(1 - drawn.lost - found) - 7 * drawn.lost_error, 0.);
  }

  /// Evaluates f cos / pdf at a sample of the guide.
  void evaluate_sample(const Vec3<double>& u, double* out) const {
    const Sample<double> s = guide_.sample(wo_, u);
    require_value(s.pdf, "pdf", label_, s.wi, wo_);
    if (!(s.pdf > 0)) {
      std::fill_n(out, n_, 0.);
      return;
    }
    evaluate(s.wi, out);
    for (std::size_t k = 0; k < n_; ++k) out[k] /= s.pdf;
  }

  /// The places in one lobe's unit square that map to the directions sampled by the other lobes. There f cos / pdf has
  /// a bump or a hole as narrow as those lobes. `u1` selects the lobe.
  std::vector<Point2> preimages(double u1, const std::vector<Vec3<double>>& others, int grid) const {
    const auto at = [&](const Point2& p) { return guide_.sample(wo_, {u1, p.x, p.y}).wi; };
    std::vector<Point2> places;
    std::vector<Vec3<double>> directions;
    for (int i = 0; i < grid; ++i)
      for (int j = 0; j < grid; ++j) {
        places.push_back({(i + 0.5) / grid, (j + 0.5) / grid});
        directions.push_back(at(places.back()));
      }
    std::vector<Point2> out;
    for (const Vec3<double>& target : others) {
      std::size_t nearest = 0;
      double best = -2;
      for (std::size_t i = 0; i < directions.size(); ++i)
        if (const double c = dot(directions[i], target); c > best) best = c, nearest = i;
      // Gauss-Newton iteration with difference quotients.
      Point2 p = places[nearest];
      Vec3<double> r = target - directions[nearest];
      for (int step = 0; step < 8; ++step) {
        constexpr double h = 1e-7;
        const double hx = p.x < 0.5 ? h : -h, hy = p.y < 0.5 ? h : -h;
        const Vec3<double> here = at(p);
        r = target - here;
        const Vec3<double> dx = (at({p.x + hx, p.y}) - here) / hx, dy = (at({p.x, p.y + hy}) - here) / hy;
        const double xx = dot(dx, dx), xy = dot(dx, dy), yy = dot(dy, dy), det = xx * yy - xy * xy;
        if (!(det > 0)) break;
        const double bx = dot(dx, r), by = dot(dy, r);
        p.x = std::clamp(p.x + (yy * bx - xy * by) / det, 0., 1 - 1e-12);
        p.y = std::clamp(p.y + (xx * by - xy * bx) / det, 0., 1 - 1e-12);
      }
      if (length(r) < 1e-3) out.push_back(p);
    }
    return out;
  }

  /// True if the sampled direction does not depend on the first random number within a lobe: see lobe_borders().
  bool lobes_are_known() const { return !lobe_borders(guide_, wo_).empty(); }

  /// Integrates over the random numbers of sample(). The guide's lobes must be known.
  CubatureResult over_samples(const CubatureOptions& options, int effort) const {
    CubatureResult sum;
    const std::vector<double> borders = lobe_borders(guide_, wo_);
    sum.value.assign(n_, 0);
    sum.error.assign(n_, 0);
    sum.converged = true;
    const std::size_t lobes = borders.size() - 1;
    for (std::size_t lobe = 0; lobe < lobes; ++lobe) {
      const double width = borders[lobe + 1] - borders[lobe], u1 = borders[lobe] + 0.5 * width;
      std::vector<Vec3<double>> others;
      for (std::size_t other = 0; other < lobes; ++other) {
        if (other == lobe) continue;
        Sequence2 sequence(2);
        for (int i = 0; i < 32 << (2 * effort); ++i) {
          const Point2 p = sequence.next();
          const Sample<double> s = guide_.sample(wo_, {0.5 * (borders[other] + borders[other + 1]), p.x, p.y});
          if (s.pdf > 0) others.push_back(s.wi);
        }
      }
      const std::vector<Point2> seeds = preimages(u1, others, 16 << effort);
      // At least four cells on each side, because sample() may map each quadrant of the unit square separately.
      std::vector<Rect> cells;
      const int grid = 4 << effort;
      for (int i = 0; i < grid; ++i)
        for (int j = 0; j < grid; ++j) {
          const auto parts =
              partition({double(i) / grid, double(i + 1) / grid, double(j) / grid, double(j + 1) / grid}, seeds, 4);
          cells.insert(cells.end(), parts.begin(), parts.end());
        }
      const CubatureResult r = integrate(
          [&](double x, double y, double* out) {
            evaluate_sample({u1, x, y}, out);
          },
          n_, cells, options);
      for (std::size_t k = 0; k < n_; ++k) {
        sum.value[k] += width * r.value[k];
        sum.error[k] += width * r.error[k];
      }
      sum.cells += r.cells;
      sum.converged = sum.converged && r.converged;
    }
    return sum;
  }

  /// Mean and standard error over low-discrepancy samples: `count` samples per lobe where the lobes are known. This is
  /// a plain average of bounded weights, so no peak or ridge can escape it.
  CubatureResult witness(int count) const {
    CubatureResult out;
    std::vector<double> borders = lobe_borders(guide_, wo_);
    const bool known = !borders.empty();
    if (!known) borders = {0, 1};
    const int n = count / kReplicates;
    std::vector<double> scratch(n_);
    std::vector<std::vector<double>> means(kReplicates, std::vector<double>(n_, 0.));
    out.value.assign(n_, 0);
    out.error.assign(n_, 0);
    for (int k = 0; k < kReplicates; ++k)
      for (std::size_t lobe = 0; lobe + 1 < borders.size(); ++lobe) {
        const double width = borders[lobe + 1] - borders[lobe];
        Sequence3 sequence(std::uint64_t(5000 + k));
        Sequence2 plane(std::uint64_t(5000 + k));
        for (int i = 0; i < n; ++i) {
          Vec3<double> u;
          if (known) {
            const Point2 p = plane.next();
            u = {borders[lobe] + 0.5 * width, p.x, p.y};
          } else {
            u = sequence.next();
          }
          evaluate_sample(u, scratch.data());
          for (std::size_t c = 0; c < n_; ++c) means[std::size_t(k)][c] += scratch[c] * width / n;
        }
      }
    for (std::size_t c = 0; c < n_; ++c) {
      for (const auto& m : means) out.value[c] += m[c] / kReplicates;
      for (const auto& m : means) out.error[c] += sqr(m[c] - out.value[c]);
      out.error[c] = std::sqrt(out.error[c] / (kReplicates * (kReplicates - 1)));
    }
    return out;
  }

 private:
  const Brdf<double>& guide_;
  const std::vector<const Brdf<double>*>& models_;
  const Vec3<double> wo_;
  const std::string& label_;
  std::size_t n_;
};

double largest(const std::vector<double>& v) { return *std::max_element(v.begin(), v.end()); }

double distance(const CubatureResult& a, const CubatureResult& b) {
  double d = 0;
  for (std::size_t k = 0; k < a.value.size(); ++k) d = std::max(d, std::abs(a.value[k] - b.value[k]));
  return d;
}

struct Estimate {
  std::vector<double> value;
  double error = 0;
};

/// What an edge across the cells over directions changes at most if two meshes take it for smooth.
constexpr double kEdges = 3e-5;

/// The estimate for models whose sample() can't be integrated over its random numbers: the integral over directions if
/// two meshes agree and contain all of the guide's density, or if it agrees with the mean of samples; otherwise that
/// mean.
Estimate estimate_over_directions(const AlbedoIntegrator& integrator, const AlbedoOptions& options,
                                  const CubatureOptions& cubature, double slack) {
  CubatureResult directions = integrator.over_directions(cubature, 512);
  for (int effort = 1; effort < 3; ++effort) {
    const int guides = 512 << effort;
    const CubatureResult finer = integrator.over_directions(cubature, guides);
    const double moved = distance(directions, finer), rule = largest(finer.error);
    directions = finer;
    if (rule > slack || moved > slack) continue;
    const double missed = integrator.missed_density(cubature, guides);
    if (missed <= slack) return {directions.value, std::max({rule, moved, missed, kEdges})};
  }
  const CubatureResult witness = integrator.witness(options.witnesses);
  const double chance = largest(witness.error), apart = distance(directions, witness);
  if (apart <= 7 * chance + 1e-12) return {directions.value, std::max({largest(directions.error), chance, apart})};
  return {witness.value, 3 * chance};
}

Estimate estimate(const AlbedoIntegrator& integrator, const AlbedoOptions& options) {
  const CubatureOptions cubature{options.absolute, 0, options.max_cells};
  // The rule overestimates its true error by far, unless it has missed a feature. At a kink the true error may be some
  // hundred times `absolute`; a larger difference means that a feature was missed.
  const double slack = 200 * options.absolute;
  CubatureResult directions, samples;
  if (!integrator.lobes_are_known()) return estimate_over_directions(integrator, options, cubature, slack);
  double directions_moved = 0, samples_moved = 0;  // between the last two meshes
  bool ridge = false;
  for (int effort = 0; effort < 3; ++effort) {
    CubatureResult before = std::move(samples);
    samples = integrator.over_samples(cubature, effort);
    if (effort > 0) samples_moved = distance(before, samples);
    if (!ridge) {
      before = std::move(directions);
      directions = integrator.over_directions(cubature, 512 << effort);
      if (effort > 0) directions_moved = distance(before, directions);
    }
    const double apart = distance(directions, samples);
    const double d = largest(directions.error), s = largest(samples.error);
    if (apart <= d + s + slack && std::min(d, s) <= slack) {
      // The cells over directions are cut along the model's kinks; the squares over random numbers are not.
      if (d <= slack) return {directions.value, std::max(d, apart)};
      return {samples.value, std::max(s, apart)};
    }
    // If two meshes over directions agree, they are trusted; the integrals over samples all rely on the pdf and may be
    // wrong. There are two exceptions: edges across the cells, which both meshes may take for smooth, and peaks that
    // both missed. A missed peak shows up as missed density.
    if (effort > 0 && d <= slack && directions_moved <= slack) {
      const bool missed = apart > kEdges && integrator.missed_density(cubature, 512 << effort) > kEdges;
      return {directions.value, std::max({d, directions_moved, missed ? apart : std::min(apart, kEdges)})};
    }
    // A thin curved ridge never converges over directions, whatever the number of guides.
    ridge = effort > 0 && d > slack;
  }
  const CubatureResult witness = integrator.witness(options.witnesses);
  const double chance = largest(witness.error), noise = 7 * chance + 1e-12;
  const double d = distance(directions, witness), s = distance(samples, witness);
  if (s <= noise && samples.converged && samples_moved <= slack)
    return {samples.value, std::max(largest(samples.error), samples_moved)};
  if (d <= noise && d <= s) return {directions.value, std::max({largest(directions.error), chance, d})};
  if (s <= noise) return {samples.value, std::max({largest(samples.error), chance, s})};
  return {witness.value, std::max(3 * chance, std::min(d, s))};
}

}  // namespace

Albedo albedo(const Brdf<double>& brdf, double cos_theta_o, double phi_o, const std::string& label,
              const AlbedoOptions& options) {
  const Vec3<double> wo = direction(cos_theta_o, phi_o);
  const std::vector<const Brdf<double>*> models{&brdf};
  const Estimate e = estimate(AlbedoIntegrator(brdf, models, wo, label), options);
  Albedo out;
  out.scattered = {e.value[0], e.value[1], e.value[2]};
  out.mirror = brdf.mirror(wo);
  out.transmit = brdf.transmit(wo);
  out.error = e.error;
  require_value(out.mirror, "mirror", label, {-wo.x, -wo.y, wo.z}, wo);
  require_value(out.transmit, "transmit", label, {-wo.x, -wo.y, -wo.z}, wo);
  return out;
}

MeanAlbedo mean_albedos(const Brdf<double>& guide, const std::vector<const Brdf<double>*>& models, double cos_theta_o,
                        std::optional<double> phi_o, const std::string& label, int count, std::uint64_t seed) {
  constexpr int kCopies = 4;
  const std::size_t n = 6 * models.size();  // scattered, then mirror terms
  std::vector<std::vector<double>> means(kCopies, std::vector<double>(n, 0.));
  std::vector<double> borders = lobe_borders(guide, direction(cos_theta_o, phi_o.value_or(0.3)));
  // For a mean over azimuths the lobes are sampled separately only if their intervals are the same at each azimuth.
  for (int k = 1; k < 8 && !phi_o && !borders.empty(); ++k) {
    const std::vector<double> there = lobe_borders(guide, direction(cos_theta_o, 0.3 + 2 * kPi * k / 8));
    const auto close = [](double a, double b) { return std::abs(a - b) < 1e-12; };
    if (!std::ranges::equal(borders, there, close)) borders.clear();
  }
  const bool known = !borders.empty();
  if (!known) borders = {0, 1};
  const int each = std::max(1, count / kCopies);
  // The tent map makes the integrand periodic, for which the sequence converges faster.
  const auto tent = [](double u) { return std::min(1 - std::abs(2 * u - 1), 1 - 1e-16); };
  std::vector<double> scratch(n);
  const auto mirrors = [&](const Vec3<double>& wo) {
    double* out = &scratch[3 * models.size()];
    for (const Brdf<double>* model : models) {
      const Rgb<double> mirror = model->mirror(wo) + model->transmit(wo);
      require_value(mirror, "mirror", label, {-wo.x, -wo.y, wo.z}, wo);
      *out++ = mirror.r;
      *out++ = mirror.g;
      *out++ = mirror.b;
    }
  };
  Vec3<double> wo;
  if (phi_o) {
    wo = direction(cos_theta_o, *phi_o);
    mirrors(wo);
  }
  for (int k = 0; k < kCopies; ++k)
    for (std::size_t lobe = 0; lobe + 1 < borders.size(); ++lobe) {
      const double width = borders[lobe + 1] - borders[lobe];
      Sequence3 sequence(9000 + 16 * seed + std::uint64_t(k));
      std::mt19937_64 random(seed + std::uint64_t(k));
      for (int i = 0; i < each; ++i) {
        const Vec3<double> p = sequence.next();
        const double choice = known ? 0.5 : phi_o ? p.z : double(random() >> 11) * 0x1p-53;
        if (!phi_o) {
          wo = direction(cos_theta_o, 2 * kPi * p.z);
          mirrors(wo);
        }
        const AlbedoIntegrator integrator(guide, models, wo, label);
        integrator.evaluate_sample({borders[lobe] + choice * width, tent(p.x), tent(p.y)}, scratch.data());
        for (std::size_t c = 0; c < n; ++c) means[std::size_t(k)][c] += scratch[c] * width / each;
      }
    }
  MeanAlbedo out;
  for (std::size_t m = 0; m < 2 * models.size(); ++m) {
    std::array<double, 3> mean{};
    for (std::size_t c = 0; c < 3; ++c) {
      for (const auto& copy : means) mean[c] += copy[3 * m + c] / kCopies;
      double variance = 0;
      for (const auto& copy : means) variance += sqr(copy[3 * m + c] - mean[c]) / (kCopies * (kCopies - 1));
      out.error = std::max(out.error, std::sqrt(variance));
    }
    (m < models.size() ? out.scattered : out.mirror).push_back({mean[0], mean[1], mean[2]});
  }
  return out;
}

SampledAlbedo sampled_albedo(const Brdf<double>& brdf, double cos_theta_o, double phi_o, const std::string& label,
                             int count) {
  const Vec3<double> wo = direction(cos_theta_o, phi_o);
  const int n = std::max(1, count / kReplicates);
  std::array<Rgb<double>, kReplicates> mean;
  std::array<double, kReplicates> lost{};
  for (int k = 0; k < kReplicates; ++k) {
    Sequence3 sequence(std::uint64_t(1000 + k));
    Rgb<double> sum(0);
    int below = 0;
    for (int i = 0; i < n; ++i) {
      const Sample<double> s = brdf.sample(wo, sequence.next());
      require_value(s.pdf, "pdf", label, s.wi, wo);
      require_value(s.weight, "weight", label, s.wi, wo);
      if (s.pdf > 0)
        sum += s.weight;
      else
        ++below;
    }
    mean[k] = sum / double(n);
    lost[k] = double(below) / n;
  }
  SampledAlbedo out;
  out.scattered = Rgb<double>(0);
  for (int k = 0; k < kReplicates; ++k) {
    out.scattered += mean[k] / double(kReplicates);
    out.lost += lost[k] / kReplicates;
  }
  Rgb<double> variance(0);
  double lost_variance = 0;
  for (int k = 0; k < kReplicates; ++k) {
    const Rgb<double> d = mean[k] - out.scattered;
    variance += d * d;
    lost_variance += sqr(lost[k] - out.lost);
  }
  const double scale = 1. / (kReplicates * (kReplicates - 1));
  out.standard_error = std::sqrt(max_component(variance) * scale);
  // At least the weight of one sample: otherwise losses so rare that none occurred would have an error of 0.
  out.lost_error = std::max(std::sqrt(lost_variance * scale), 1. / count);
  return out;
}

}  // namespace brdfc::measure
