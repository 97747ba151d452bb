// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/statistics.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/error.h"

namespace brdfc::report {

using reference::Image;
using reference::Rendering;

Rendering mean_of(std::span<const Rendering> renderings) {
  if (renderings.empty()) throw std::invalid_argument("no rendering");
  if (renderings.size() == 1) return renderings.front();
  const Image& first = renderings.front().mean;
  for (const Rendering& r : renderings)
    if (r.mean.width != first.width || r.mean.height != first.height)
      throw std::invalid_argument("renderings differ in size");
  const double n = double(renderings.size());
  Rendering out;
  out.working_space = renderings.front().working_space;
  out.mean = Image(first.width, first.height);
  out.variance = Image(first.width, first.height);
  for (std::size_t i = 0; i < first.rgb.size(); ++i) {
    double sum = 0;
    for (const Rendering& r : renderings) sum += r.mean.rgb[i];
    double squares = 0;
    for (const Rendering& r : renderings) squares += sqr(r.mean.rgb[i] - sum / n);
    out.mean.rgb[i] = float(sum / n);
    out.variance->rgb[i] = float(squares / (n - 1) / n);
  }
  return out;
}

Difference measure_difference(const Rendering& picture, const Rendering& reference, const std::string& picture_name,
                              const std::string& reference_name) {
  const reference::Comparison comparison = reference::compare(picture, reference, picture_name, reference_name);
  if (!(comparison.mean_b > 0)) input_error("{}: the picture is black", reference_name);
  const std::size_t count = reference.mean.rgb.size();
  double noise = 0, variance_a = 0, variance_b = 0;
  for (std::size_t i = 0; i < count; i += 3) {
    double deviation_a = 0, deviation_b = 0;
    for (std::size_t c = i; c < i + 3; ++c) {
      const double va = picture.variance ? picture.variance->rgb[c] : 0;
      const double vb = reference.variance ? reference.variance->rgb[c] : 0;
      noise += (va + vb) / (sqr(double(reference.mean.rgb[c])) + kRelMseEpsilon);
      deviation_a += std::sqrt(va);
      deviation_b += std::sqrt(vb);
    }
    // The channels of a pixel come from the same paths, so their errors are correlated.
    variance_a += sqr(deviation_a);
    variance_b += sqr(deviation_b);
  }
  const double ratio = comparison.mean_a / comparison.mean_b;
  Difference d;
  d.rel_mse = comparison.rel_mse;
  d.noise = noise / double(count);
  d.bias = ratio - 1;
  // First-order error propagation; the two means are independent.
  d.bias_error = std::sqrt(variance_a + sqr(ratio) * variance_b) / double(count) / comparison.mean_b;
  return d;
}

namespace {

/// Single-precision rounding in both renderers: one standard deviation, relative to the reference.
constexpr double kRounding = 1e-5;
/// The tail of a lobe far from its centre: one standard deviation, relative to the mean of the whole reference. e^-80
/// is not 0 in single precision, but the reference may have cut it off to 0 in double; the difference is invisible.
constexpr double kUnseen = 1e-12;

/// A mean, its variance, and the degrees of freedom of that variance.
struct Estimate {
  double mean = 0, variance = 0, degrees = 1;
};

/// The two-sided p-value of Welch's test: 1 if both agree without noise, 0 if they differ without noise. Radiance up to
/// `unseen` counts as none.
double welch_p(const Estimate& a, const Estimate& b, double unseen) {
  const double rounding = sqr(kRounding * b.mean) + sqr(unseen);
  const double variance = a.variance + b.variance + rounding;
  const double d = std::abs(a.mean - b.mean);
  if (!(variance > 0)) return d > 0 ? 0 : 1;
  // The variance of rounding counts as known exactly, and a variance of 0 does not reduce the degrees of freedom.
  const double lost = sqr(a.variance) / a.degrees + sqr(b.variance) / b.degrees;
  const double degrees = lost > 0 ? std::min(sqr(variance) / lost, 1e9) : 1e9;
  const boost::math::students_t t(degrees);
  return 2 * boost::math::cdf(boost::math::complement(t, d / std::sqrt(variance)));
}

double sidak(int tests) { return 1 - std::pow(1 - kTestSignificance, 1.0 / std::max(tests, 1)); }

/// The mean of pictures with equal noise, with its variance from their spread.
template <class Value> Estimate estimate(std::size_t count, const Value& value) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < count; ++i) sum += value(i);
  const double mean = sum / double(count);
  for (std::size_t i = 0; i < count; ++i) squares += sqr(value(i) - mean);
  return {mean, squares / double(count - 1) / double(count), double(count - 1)};
}

}  // namespace

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  const std::size_t half = v.size() / 2;
  return v.size() % 2 ? v[half] : (v[half - 1] + v[half]) / 2;
}

bool Difference::biased() const { return std::abs(bias) > 3 * bias_error && std::abs(bias) > 1e-5; }

bool WelchTest::passed() const { return accepted() >= kTestAccepted && rejected_tiles == 0; }

nlohmann::ordered_json to_json(const WelchTest& t) {
  return {{"passed", t.passed()},
          {"pixels", t.pixels},
          {"rejected_pixels", t.rejected_pixels},
          {"accepted", t.accepted()},
          {"worst_pixel_p", t.worst_pixel},
          {"tiles", t.tiles},
          {"rejected_tiles", t.rejected_tiles},
          {"worst_tile_p", t.worst_tile},
          {"uniform_p", t.uniform},
          {"histogram", t.histogram}};
}

WelchTest welch_test(std::span<const Rendering> pictures, const Rendering& reference, const std::string& picture_name,
                     const std::string& reference_name) {
  if (pictures.size() < 2) throw std::invalid_argument("Welch's test needs two pictures at least");
  if (!reference.variance) throw std::invalid_argument("Welch's test needs the reference's variance");
  for (const Rendering& r : pictures)
    reference::compare(r, reference, picture_name, reference_name);  // checks sizes and finite values

  const int width = reference.mean.width, height = reference.mean.height;
  const double samples = reference.metadata.is_object() ? reference.metadata.value("samples", 1e6) : 1e6;
  const auto reference_at = [&](int x, int y) {
    const Rgb<double> v = reference.variance->color(x, y);
    const double deviation = luminance(Rgb<double>(std::sqrt(v.r), std::sqrt(v.g), std::sqrt(v.b)));
    return Estimate{luminance(reference.mean.color(x, y)), sqr(deviation), std::max(samples - 1, 1.0)};
  };
  const auto picture_at = [&](std::size_t i, int x, int y) { return luminance(pictures[i].mean.color(x, y)); };

  double unseen = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) unseen += kUnseen * reference_at(x, y).mean / (double(width) * height);

  WelchTest test;
  test.p = Image(width, height);
  const double pixel_limit = sidak(width * height);
  int noisy = 0;
  std::vector<double> tile_p;
  for (int y0 = 0; y0 < height; y0 += kTestTile)
    for (int x0 = 0; x0 < width; x0 += kTestTile) {
      const int x1 = std::min(x0 + kTestTile, width), y1 = std::min(y0 + kTestTile, height);
      const double n = double(x1 - x0) * (y1 - y0);
      std::vector<double> means(pictures.size(), 0);
      // Estimates for the tile's mean, and for an average pixel of the tile.
      Estimate b{0, 0, std::max(samples - 1, 1.0)}, usual_a{0, 0, n * double(pictures.size() - 1)}, usual_b = b;
      std::vector<std::pair<Estimate, Estimate>> pixels;
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
          for (std::size_t i = 0; i < pictures.size(); ++i) means[i] += picture_at(i, x, y) / n;
          const auto& [of_a, of_b] = pixels.emplace_back(
              estimate(pictures.size(), [&](std::size_t i) { return picture_at(i, x, y); }), reference_at(x, y));
          b.mean += of_b.mean / n;
          b.variance += of_b.variance / n / n;
          usual_a.variance += of_a.variance / n;
          usual_b.variance += of_b.variance / n;
        }
      const Estimate a = estimate(means.size(), [&](std::size_t i) { return means[i]; });
      // What the tile's mean would vary by if its pixels' noise were independent, which filters and denoisers prevent.
      const Estimate independent{a.mean, usual_a.variance / n, usual_a.degrees};
      tile_p.push_back(std::max(welch_p(a, b, unseen), welch_p(independent, b, unseen)));
      test.worst_tile = std::min(test.worst_tile, tile_p.back());
      std::size_t i = 0;
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x, ++i) {
          const auto& [of_a, of_b] = pixels[i];
          const double alone = welch_p(of_a, of_b, unseen);
          usual_a.mean = of_a.mean, usual_b.mean = of_b.mean;
          const double p = std::max(alone, welch_p(usual_a, usual_b, unseen));
          for (int c = 0; c < 3; ++c) test.p.pixel(x, y)[c] = float(p);
          test.worst_pixel = std::min(test.worst_pixel, p);
          test.rejected_pixels += p < pixel_limit;
          if (of_a.variance + of_b.variance > sqr(kRounding * of_b.mean)) {
            ++noisy;
            ++test.histogram[std::min(std::size_t(alone * double(test.histogram.size())), test.histogram.size() - 1)];
          }
        }
    }
  test.pixels = width * height;
  test.tiles = int(tile_p.size());
  const double tile_limit = sidak(test.tiles);
  test.rejected_tiles = int(std::count_if(tile_p.begin(), tile_p.end(), [&](double p) { return p < tile_limit; }));

  const double expected = double(noisy) / double(test.histogram.size());
  if (expected >= 5) {
    double statistic = 0;
    for (const int n : test.histogram) statistic += sqr(n - expected) / expected;
    const boost::math::chi_squared distribution(double(test.histogram.size() - 1));
    test.uniform = boost::math::cdf(boost::math::complement(distribution, statistic));
  }
  return test;
}

}  // namespace brdfc::report
