// SPDX-License-Identifier: GPL-3.0-or-later
#include "analysis/albedo.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace brdfc {
namespace {

// Replicates of the sequence, for its error: enough that 7 standard errors are all but impossible (t, 15 d.o.f.).
constexpr int kReplicates = 16;

std::string text(const Vec3<double>& w) { return fmt::format("({:.17g}, {:.17g}, {:.17g})", w.x, w.y, w.z); }

[[noreturn]] void bad_value(const std::string& value, const char* what, const std::string& label,
                            const Vec3<double>& wi, const Vec3<double>& wo) {
  throw ValueError(fmt::format("{}: {}(wi={}, wo={}) = {}, expected finite and >= 0", label.empty() ? "model" : label,
                               what, text(wi), text(wo), value));
}

bool good(double v) { return v >= 0 && std::isfinite(v); }

/// The intervals of the first random number on which sample() uses one lobe: ends, increasing from 0 to 1. Empty if the
/// direction changes with it everywhere.
std::vector<double> lobe_borders(const Brdf<double>& brdf, const Vec3<double>& wo) {
  constexpr int kProbes = 16;
  const auto at = [&](double u) { return brdf.sample(wo, {u, 0.37, 0.71}).wi; };
  const auto same = [](const Vec3<double>& a, const Vec3<double>& b) { return length(a - b) < 1e-12; };
  std::vector<double> borders{0};
  double from = 0;
  Vec3<double> before = at(from);
  for (int i = 0; i <= kProbes; ++i) {
    const double to = i < kProbes ? (i + 0.5) / kProbes : 1 - 0x1p-53;
    const Vec3<double> after = at(to);
    // A lobe that is drawn rarely may lie between two probes: every border up to here, one by one.
    while (!same(before, after)) {
      double lo = from, hi = to;
      while (hi - lo > 1e-15) {
        const double mid = 0.5 * (lo + hi);
        (same(at(mid), before) ? lo : hi) = mid;
      }
      borders.push_back(hi);
      if (borders.size() > kProbes / 2) return {};
      from = hi;
      before = at(from);
    }
    from = to;
  }
  borders.push_back(1);
  return borders;
}

/// Directions on both sides of a jump of sample() as its third number goes round, of one lobe. Where a model folds rays
/// back, its density jumps along the image of the fold: a curve that a cubature must be led to.
std::vector<Vec3<double>> folds(const Brdf<double>& brdf, const Vec3<double>& wo, double u1) {
  constexpr int kTrial = 8, kLines = 192, kSteps = 16;
  constexpr std::size_t kMost = 768;
  std::vector<Vec3<double>> out;
  Sequence2 sequence(3);
  for (int line = 0; line < kLines; ++line) {
    if ((line == kTrial && out.empty()) || out.size() >= kMost) break;
    const Point2 p = sequence.next();
    const auto at = [&](double z) { return brdf.sample(wo, {u1, p.x, wrap(z)}); };
    std::array<double, kSteps> steps;
    for (int i = 0; i < kSteps; ++i)
      steps[std::size_t(i)] = length(at(p.y + double(i + 1) / kSteps).wi - at(p.y + double(i) / kSteps).wi);
    std::array<double, kSteps> sorted = steps;
    std::sort(sorted.begin(), sorted.end());
    for (int i = 0; i < kSteps; ++i) {
      // A smooth map goes round in steps of about equal length.
      if (!(steps[std::size_t(i)] > 4 * sorted[kSteps / 4])) continue;
      double lo = p.y + double(i) / kSteps, hi = p.y + double(i + 1) / kSteps, halfway = 0;
      for (int k = 0; k < 40; ++k) {
        const double mid = 0.5 * (lo + hi), left = length(at(mid).wi - at(lo).wi),
                     right = length(at(hi).wi - at(mid).wi);
        (left > right ? hi : lo) = mid;
        if (k == 20) halfway = std::max(left, right);
      }
      const Sample<double> a = at(lo), b = at(hi);
      // A jump stays as large as it is, however near its two sides are looked at.
      if (!(length(a.wi - b.wi) > 0.9 * halfway)) continue;
      for (const Sample<double>& s : {a, b})
        if (s.pdf > 0) out.push_back(s.wi);
    }
  }
  return out;
}

}  // namespace

BoundModel bind_model(const Model& model, const ParamValues& values) {
  BoundModel bound;
  bound.model = &model;
  bound.values = complete(model.info(), values);
  bound.brdf = model.make_double(bound.values);
  bound.label = fmt::format("{} {}", model.info().name, format_values(model.info(), bound.values));
  return bound;
}

void require_value(double value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo) {
  if (!good(value)) bad_value(fmt::format("{:.17g}", value), what, label, wi, wo);
}

void require_value(const Rgb<double>& v, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo) {
  if (!good(v.r) || !good(v.g) || !good(v.b))
    bad_value(fmt::format("{:.17g}, {:.17g}, {:.17g}", v.r, v.g, v.b), what, label, wi, wo);
}

Guides::Guides(const Brdf<double>& brdf, const Vec3<double>& wo, int each) : brdf_(brdf), wo_(wo) {
  sin_o_ = std::hypot(wo.x, wo.y);
  theta_o_ = std::atan2(sin_o_, wo.z);
  // Beyond the critical angle nothing comes through: f jumps there.
  if (brdf.scatters_through()) edge_ = kPi - std::asin(std::min(1 / brdf.ior(), 1.));
  cos_phi_ = sin_o_ > 0 ? wo.x / sin_o_ : 1;
  sin_phi_ = sin_o_ > 0 ? wo.y / sin_o_ : 0;
  std::vector<double> borders = lobe_borders(brdf, wo);
  if (borders.empty()) borders = {0, 1};
  lobes_.resize(borders.size() - 1);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> octaves(1, 30);
  for (std::size_t lobe = 0; lobe < lobes_.size(); ++lobe) {
    std::vector<Point2>& points = lobes_[lobe];
    Sequence3 sequence(1);
    // Half of them crowd towards the ends of the random numbers at all scales, which lead to the tails.
    const auto crowd = [&](double v) {
      const double near = 0.5 * std::exp2(-octaves(random));
      return v < 0.5 ? near : 1 - near;
    };
    for (int i = 0; i < each; ++i) {
      Vec3<double> u = sequence.next();
      u.x = borders[lobe] + (borders[lobe + 1] - borders[lobe]) * u.x;
      if (i % 8 == 1 || i % 8 == 3) u.y = crowd(u.y);
      if (i % 8 == 2 || i % 8 == 3) u.z = crowd(u.z);
      const Sample<double> s = brdf.sample(wo, u);
      if (s.pdf > 0) points.push_back(angles(s.wi));
    }
    // Around every cluster, points at distances of all scales: a narrow lobe's flank, where few samples fall but
    // which still holds light, then lies in cells that grow with the distance from it.
    for (std::size_t i = 0, n = points.size(); i + 1 < n; ++i) {
      const double t = std::exp2(octaves(random));
      points.push_back(
          {points[i].x + t * (points[i].x - points[i + 1].x), points[i].y + t * (points[i].y - points[i + 1].y)});
    }
  }
  std::vector<Point2> edges;
  for (std::size_t lobe = 0; lobe + 1 < borders.size(); ++lobe)
    for (const Vec3<double>& w : folds(brdf, wo, 0.5 * (borders[lobe] + borders[lobe + 1]))) edges.push_back(angles(w));
  if (!edges.empty()) lobes_.push_back(std::move(edges));
}

Point2 Guides::angles(const Vec3<double>& wi) const {
  const double x = cos_phi_ * wi.x + sin_phi_ * wi.y, y = cos_phi_ * wi.y - sin_phi_ * wi.x;
  const double phi = std::atan2(y, x);
  return {std::atan2(std::hypot(x, y), wi.z), phi < 0 ? phi + 2 * kPi : phi};
}

Vec3<double> Guides::direction_at(double theta, double phi) const {
  const double s = std::sin(theta), x = s * std::cos(phi), y = s * std::sin(phi);
  return {cos_phi_ * x - sin_phi_ * y, sin_phi_ * x + cos_phi_ * y, std::cos(theta)};
}

std::vector<Rect> Guides::cells(std::size_t most) const {
  // Cut at the mirror direction, where a lobe's peak or a kink of max(cos_i, cos_o) lies.
  std::vector<Rect> out;
  std::vector<double> cuts{0, std::min(theta_o_, kPi / 2), std::max(theta_o_, kPi / 2)};
  if (edge_ > 0) cuts.push_back(kPi);
  for (const double phi : {0., kPi})
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
      if (const Rect r{cuts[i], cuts[i + 1], phi, phi + kPi}; r.x1 > r.x0) {
        const std::vector<Rect> parts = cells(r, most);
        out.insert(out.end(), parts.begin(), parts.end());
      }
  // Where a peak on that cone holds a hundredth of the light, too few samples fall to lead to it: cells there are
  // halved towards it as long as that changes what is seen.
  const auto value = [&](double theta, double phi) {
    const Vec3<double> wi = direction_at(theta, phi);
    return max_component(brdf_.eval(wi, wo_)) + brdf_.pdf(wi, wo_);
  };
  for (std::size_t i = 0, n = out.size(); i < n; ++i) {
    const auto at_cone = [&] { return out[i].x0 == theta_o_ || out[i].x1 == theta_o_; };
    const double phi = 0.5 * (out[i].y0 + out[i].y1), peak = at_cone() ? value(theta_o_, phi) : 0;
    while (at_cone() && out[i].x1 - out[i].x0 > 1e-8) {
      const double middle = 0.5 * (out[i].x0 + out[i].x1), beside = value(middle, phi);
      if (std::abs(peak - beside) <= 0.1 * std::max(peak, beside)) break;
      Rect far = out[i];
      (out[i].x0 == theta_o_ ? out[i].x1 : out[i].x0) = middle;
      (far.x0 == theta_o_ ? far.x0 : far.x1) = middle;
      out.push_back(far);
    }
  }
  return out;
}

std::vector<Rect> Guides::cells(const Rect& whole, std::size_t most) const {
  std::vector<Rect> parts{whole};
  if (edge_ > whole.x0 && edge_ < whole.x1)
    parts = {{whole.x0, edge_, whole.y0, whole.y1}, {edge_, whole.x1, whole.y0, whole.y1}};
  // Each lobe for itself: the samples of a wide lobe would hide that those of a narrow one fill only a corner.
  for (const std::vector<Point2>& all : lobes_) {
    // What lies elsewhere would be passed over for every part anew.
    std::vector<Point2> points;
    for (const Point2& p : all)
      if (p.x >= whole.x0 && p.x < whole.x1 && p.y >= whole.y0 && p.y < whole.y1) points.push_back(p);
    std::vector<Rect> finer;
    for (const Rect& part : parts) {
      const std::vector<Rect> more = partition(part, points, most);
      finer.insert(finer.end(), more.begin(), more.end());
    }
    parts = std::move(finer);
  }
  return parts;
}

CubatureResult integrate_hemisphere(const Brdf<double>& guide, const Vec3<double>& wo, std::size_t components,
                                    const std::function<void(const Vec3<double>& wi, double*)>& integrand,
                                    const CubatureOptions& options, int guides) {
  const Guides g(guide, wo, guides);
  const Integrand2 in_angles = [&](double theta, double phi, double* out) {
    integrand(g.direction_at(theta, phi), out);
    for (std::size_t k = 0; k < components; ++k) out[k] *= std::sin(theta);
  };
  return integrate(in_angles, components, g.cells(8), options);
}

namespace {

class AlbedoIntegrator {
 public:
  AlbedoIntegrator(const Brdf<double>& guide, const std::vector<const Brdf<double>*>& models, const Vec3<double>& wo,
                   const std::string& label)
      : guide_(guide), models_(models), wo_(wo), label_(label), n_(3 * models.size()) {}

  /// f cos of every model.
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

  /// How much of the guide's density the cells of over_directions() miss, up to the chance of the share of lost
  /// samples.
  double missed_density(const CubatureOptions& options, int guides) const {
    const auto density = [&](const Vec3<double>& wi, double* out) {
      out[0] = guide_.pdf(wi, wo_);
      require_value(out[0], "pdf", label_, wi, wo_);
    };
    const SampledAlbedo drawn = sampled_albedo(guide_, wo_.z, std::atan2(wo_.y, wo_.x), label_);
    const double found = integrate_hemisphere(guide_, wo_, 1, density, options, guides).value[0];
    return std::max(std::abs(1 - drawn.lost - found) - 7 * drawn.lost_error, 0.);
  }

  /// f cos / pdf at a sample of the guide.
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

  /// Where in the unit square of one lobe the samples of the other lobes lie: there f cos / pdf has a bump or a hole as
  /// narrow as they are. `u1` chooses the lobe.
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
      // Gauss-Newton with difference quotients.
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

  /// Not converged, without value, if the choice of lobe can't be told apart from the direction.
  CubatureResult over_samples(const CubatureOptions& options, int effort) const {
    CubatureResult sum;
    sum.error.assign(n_, std::numeric_limits<double>::infinity());
    const std::vector<double> borders = lobe_borders(guide_, wo_);
    if (borders.empty()) return sum;
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
      // At least four cells a side: sample() may map each quadrant of the unit square on its own.
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

  /// Mean and standard error over low-discrepancy samples, `count` a lobe where the lobes can be told apart: what is
  /// left is a plain average of bounded weights, which no peak or ridge can escape.
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

Estimate estimate(const AlbedoIntegrator& integrator, const AlbedoOptions& options) {
  const CubatureOptions cubature{options.absolute, 0, options.max_cells};
  // The rule's estimates are far above its true error, unless it missed something. At a kink they may be passed by
  // some hundred times the aim; what differs by more was missed.
  const double slack = 200 * options.absolute;
  CubatureResult directions, samples;
  double directions_moved = 0, samples_moved = 0;  // between the last two meshes
  bool ridge = false;
  for (int effort = 0; effort < 3; ++effort) {
    CubatureResult before = std::move(samples);
    samples = integrator.over_samples(cubature, effort);
    if (samples.value.empty()) samples.value.assign(samples.error.size(), 0);
    if (effort > 0) samples_moved = distance(before, samples);
    if (!ridge) {
      before = std::move(directions);
      directions = integrator.over_directions(cubature, 512 << effort);
      if (effort > 0) directions_moved = distance(before, directions);
    }
    const double apart = distance(directions, samples);
    const double d = largest(directions.error), s = largest(samples.error);
    if (apart <= d + s + slack && std::min(d, s) <= slack) {
      // Kinks of the model are met by the cut cells of the first, and not by the squares of the second.
      if (d <= slack) return {directions.value, std::max(d, apart)};
      return {samples.value, std::max(s, apart)};
    }
    // Two meshes that agree are right; the samples, which all trust the density, may then not be.
    // Except for edges across the cells, which both may take for smooth, and for peaks that both missed: the density is
    // then seen to miss them too.
    constexpr double kEdges = 3e-5;
    if (effort > 0 && d <= slack && directions_moved <= slack) {
      const bool missed = apart > kEdges && integrator.missed_density(cubature, 512 << effort) > kEdges;
      return {directions.value, std::max({d, directions_moved, missed ? apart : std::min(apart, kEdges)})};
    }
    // One that is thin and curved never converges over directions, however many guides there are.
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
  const std::size_t n = 6 * models.size();  // scattered, then mirror
  std::vector<std::vector<double>> means(kCopies, std::vector<double>(n, 0.));
  std::vector<double> borders = lobe_borders(guide, direction(cos_theta_o, phi_o.value_or(0.3)));
  const bool known = !borders.empty();
  if (!known) borders = {0, 1};
  const int each = std::max(1, count / kCopies);
  // A tent makes the integrand periodic, which the sequence rewards.
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
        const double choice = known ? 0.5 : double(random() >> 11) * 0x1p-53;
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
  // At least a sample's worth: losses so rare that none came up would seem certain not to happen.
  out.lost_error = std::max(std::sqrt(lost_variance * scale), 1. / count);
  return out;
}

}  // namespace brdfc
