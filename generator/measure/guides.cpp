// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/guides.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace brdfc::measure {
namespace {

/// Pairs of directions of one lobe on both sides of a jump of sample() as its third random number goes through [0, 1).
/// Where a model folds rays back, its pdf jumps along the image of the fold: a curve that the cubature can't find by
/// itself.
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
      // A smooth map moves in steps of about equal length.
      if (!(steps[std::size_t(i)] > 4 * sorted[kSteps / 4])) continue;
      double lo = p.y + double(i) / kSteps, hi = p.y + double(i + 1) / kSteps, halfway = 0;
      for (int k = 0; k < 40; ++k) {
        const double mid = 0.5 * (lo + hi), left = length(at(mid).wi - at(lo).wi),
                     right = length(at(hi).wi - at(mid).wi);
        (left > right ? hi : lo) = mid;
        if (k == 20) halfway = std::max(left, right);
      }
      const Sample<double> a = at(lo), b = at(hi);
      // A jump keeps its size as the interval around it shrinks.
      if (!(length(a.wi - b.wi) > 0.9 * halfway)) continue;
      for (const Sample<double>& s : {a, b})
        if (s.pdf > 0) out.push_back(s.wi);
    }
  }
  return out;
}

}  // namespace

namespace {

/// Compares the sampled direction at two values of the first random number.
class SameLobe {
 public:
  SameLobe(const Brdf<double>& brdf, const Vec3<double>& wo, const Point2& others)
      : brdf_(brdf), wo_(wo), others_(others) {}
  Vec3<double> at(double u) const { return brdf_.sample(wo_, {u, others_.x, others_.y}).wi; }
  static bool same(const Vec3<double>& a, const Vec3<double>& b) { return length(a - b) < 1e-12; }

 private:
  const Brdf<double>& brdf_;
  const Vec3<double> wo_;
  const Point2 others_;
};

constexpr double kLast = 1 - 0x1p-53;

}  // namespace

std::vector<double> lobe_borders(const Brdf<double>& brdf, const Vec3<double>& wo, const Point2& others) {
  constexpr int kProbes = 16;
  const SameLobe lobe(brdf, wo, others);
  std::vector<double> borders{0};
  double from = 0;
  Vec3<double> before = lobe.at(from);
  for (int i = 0; i <= kProbes; ++i) {
    const double to = i < kProbes ? (i + 0.5) / kProbes : kLast;
    const Vec3<double> after = lobe.at(to);
    // A lobe with a small probability may lie between two probes, so every border up to `to` is located, one by one.
    while (!SameLobe::same(before, after)) {
      double lo = from, hi = to;
      while (hi - lo > 1e-15) {
        const double mid = 0.5 * (lo + hi);
        (SameLobe::same(lobe.at(mid), before) ? lo : hi) = mid;
      }
      borders.push_back(hi);
      if (borders.size() > kProbes / 2) return {};
      from = hi;
      before = lobe.at(from);
    }
    from = to;
  }
  borders.push_back(1);
  return borders;
}

std::vector<double> lobe_borders(const Brdf<double>& brdf, const Vec3<double>& wo) {
  const std::vector<double> borders = lobe_borders(brdf, wo, {0.37, 0.71});
  // Margin of the first random number beside a border; a bisection ends within 1e-15.
  constexpr double kBeside = 1e-12;
  constexpr int kOthers = 16;
  Sequence2 sequence(4);
  for (int k = 0; k < kOthers; ++k) {
    const SameLobe lobe(brdf, wo, sequence.next());
    for (std::size_t i = 0; i + 1 < borders.size(); ++i) {
      const double low = borders[i] + (i > 0 ? kBeside : 0),
                   high = i + 2 < borders.size() ? borders[i + 1] - kBeside : kLast;
      if (low < high && !SameLobe::same(lobe.at(low), lobe.at(high))) return {};
    }
  }
  return borders;
}

Guides::Guides(const Brdf<double>& brdf, const Vec3<double>& wo, int each) : brdf_(brdf), wo_(wo) {
  sin_o_ = std::hypot(wo.x, wo.y);
  theta_o_ = std::atan2(sin_o_, wo.z);
  // Beyond the critical angle no light is transmitted, so f jumps there.
  if (brdf.scatters_through()) edge_ = kPi - std::asin(std::min(1 / brdf.ior(), 1.));
  cos_phi_ = sin_o_ > 0 ? wo.x / sin_o_ : 1;
  sin_phi_ = sin_o_ > 0 ? wo.y / sin_o_ : 0;
  const std::vector<double> borders = lobe_borders(brdf, wo);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> octaves(1, 30);
  Sequence3 sequence(1);
  // Half of the random numbers crowd towards the ends of [0, 1] at all scales; these lead to the tails.
  const auto crowd = [&](double v) {
    const double near = 0.5 * std::exp2(-octaves(random));
    return v < 0.5 ? near : 1 - near;
  };
  const auto numbers = [&](int i) {
    Vec3<double> u = sequence.next();
    if (i % 8 == 1 || i % 8 == 3) u.y = crowd(u.y);
    if (i % 8 == 2 || i % 8 == 3) u.z = crowd(u.z);
    return u;
  };
  const auto add = [&](std::vector<Point2>& points, const Vec3<double>& u) {
    const Sample<double> s = brdf.sample(wo, u);
    if (s.pdf > 0) points.push_back(angles(s.wi));
  };
  // Adds points around every cluster at distances of all scales. The flank of a narrow lobe, which gets few samples but
  // still reflects light, then lies in cells that grow with the distance from the peak.
  const auto surround = [&](std::vector<Point2>& points) {
    for (std::size_t i = 0, n = points.size(); i + 1 < n; ++i) {
      const double t = std::exp2(octaves(random));
      points.push_back(
          {points[i].x + t * (points[i].x - points[i + 1].x), points[i].y + t * (points[i].y - points[i + 1].y)});
    }
  };
  if (borders.empty()) {
    // Each pair of the other random numbers has its own intervals; the n-th interval of each pair counts as the same
    // lobe.
    lobes_.resize(1);
    for (int i = 0; i < each; ++i) {
      Vec3<double> u = numbers(i);
      const std::vector<double> own = lobe_borders(brdf, wo, {u.y, u.z});
      if (own.empty()) add(lobes_[0], u);
      for (std::size_t lobe = 0; lobe + 1 < own.size(); ++lobe) {
        if (lobe == lobes_.size()) lobes_.emplace_back();
        u.x = 0.5 * (own[lobe] + own[lobe + 1]);
        add(lobes_[lobe], u);
      }
    }
    for (std::vector<Point2>& points : lobes_) surround(points);
    return;
  }
  lobes_.resize(borders.size() - 1);
  for (std::size_t lobe = 0; lobe < lobes_.size(); ++lobe) {
    sequence = Sequence3(1);
    for (int i = 0; i < each; ++i) {
      Vec3<double> u = numbers(i);
      u.x = borders[lobe] + (borders[lobe + 1] - borders[lobe]) * u.x;
      add(lobes_[lobe], u);
    }
    surround(lobes_[lobe]);
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
  // Cuts at the mirror direction, where a lobe's peak or a kink of max(cos_i, cos_o) may be.
  std::vector<Rect> out;
  std::vector<double> cuts{0, std::min(theta_o_, kPi / 2), std::max(theta_o_, kPi / 2)};
  if (edge_ > 0) cuts.push_back(kPi);
  for (const double phi : {0., kPi})
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i)
      if (const Rect r{cuts[i], cuts[i + 1], phi, phi + kPi}; r.x1 > r.x0) {
        const std::vector<Rect> parts = cells(r, most);
        out.insert(out.end(), parts.begin(), parts.end());
      }
  // A peak on that cone that reflects a hundredth of the light attracts too few samples to be found by them. So cells
  // are halved towards the cone as long as that changes the values found.
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
  // Each lobe separately: the samples of a wide lobe would hide that those of a narrow one fill only a corner.
  for (const std::vector<Point2>& all : lobes_) {
    // Points outside the rectangle are removed once, not in each of its parts again.
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

}  // namespace brdfc::measure
