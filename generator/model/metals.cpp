// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/metals.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "model/fresnel.h"
#include "model/spectrum.h"

namespace brdfc::inline model {
namespace {

constexpr const char* kNoble =
    "P. B. Johnson, R. W. Christy: Optical constants of the noble metals, Phys. Rev. B 6, 1972";
constexpr const char* kTransition =
    "P. B. Johnson, R. W. Christy: Optical constants of transition metals, Phys. Rev. B 9, 1974";
constexpr const char* kAluminium =
    "A. D. Rakic: Algorithm for the determination of intrinsic optical constants of metal films: application to "
    "aluminum, Applied Optics 34, 1995";

/// Models ask for it while they register, before this file's globals would exist: so there are none.
std::vector<Metal> published() {
  // Wavelengths in nm of the measurements.

  const std::vector<double> kNobleNm = {381.5, 397.4, 413.3, 430.5, 450.9, 471.4, 495.9,
                                        520.9, 548.6, 582.1, 616.8, 659.5, 704.5, 756};
  const std::vector<double> kTransitionNm = {381, 397, 413, 431, 451, 471, 496, 521, 549, 582, 617, 659, 704, 756};
  const std::vector<double> kAluminiumNm = {364.66, 413.28, 442.8,  476.87, 516.6, 563.57,
                                            619.93, 652.25, 688.81, 729.32, 774.91};
  return {
      {"cu",
       "copper",
       kNoble,
       kNobleNm,
       {1.33, 1.32, 1.28, 1.25, 1.24, 1.25, 1.22, 1.18, 1.02, 0.7, 0.3, 0.22, 0.21, 0.24},
       {2.045, 2.116, 2.207, 2.305, 2.397, 2.483, 2.564, 2.608, 2.577, 2.704, 3.205, 3.747, 4.205, 4.665}},
      {"au",
       "gold",
       kNoble,
       kNobleNm,
       {1.46, 1.47, 1.46, 1.45, 1.38, 1.31, 1.04, 0.62, 0.43, 0.29, 0.21, 0.14, 0.13, 0.14},
       {1.933, 1.952, 1.958, 1.948, 1.914, 1.849, 1.833, 2.081, 2.455, 2.863, 3.272, 3.697, 4.103, 4.542}},
      {"ag",
       "silver",
       kNoble,
       kNobleNm,
       {0.05, 0.05, 0.05, 0.04, 0.04, 0.05, 0.05, 0.05, 0.06, 0.05, 0.06, 0.05, 0.04, 0.03},
       {1.864, 2.07, 2.275, 2.462, 2.657, 2.869, 3.093, 3.324, 3.586, 3.858, 4.152, 4.483, 4.838, 5.242}},
      {"al",
       "aluminium",
       kAluminium,
       kAluminiumNm,
       {0.39877, 0.52135, 0.6079, 0.7278, 0.8734, 1.0728, 1.366, 1.5724, 1.8301, 2.1606, 2.6154},
       {4.3957, 5.0008, 5.3676, 5.7781, 6.2418, 6.7839, 7.4052, 7.7354, 8.0601, 8.3565, 8.4914}},
      {"fe",
       "iron",
       kTransition,
       kTransitionNm,
       {2.12, 2.24, 2.35, 2.48, 2.59, 2.67, 2.74, 2.86, 2.95, 2.94, 2.88, 2.92, 2.86, 2.87},
       {2.5, 2.58, 2.65, 2.71, 2.77, 2.82, 2.88, 2.91, 2.93, 2.99, 3.05, 3.1, 3.19, 3.28}},
      {"cr",
       "chromium",
       kTransition,
       kTransitionNm,
       {1.92, 2.0, 2.08, 2.19, 2.33, 2.51, 2.75, 2.94, 3.18, 3.22, 3.17, 3.09, 3.05, 3.08},
       {2.74, 2.83, 2.93, 3.04, 3.14, 3.24, 3.3, 3.33, 3.33, 3.3, 3.3, 3.34, 3.39, 3.42}},
  };
}

// Cosines of the fit and of its error.
constexpr int kCosines = 64;
double cosine(int i) { return (i + 1.) / kCosines; }

double fresnel(double c, double n, double k) { return fresnel_conductor(c, (1 - c) * (1 + c), n, k); }

/// Least squares over log n and log k by Levenberg's and Marquardt's method, kept inside a box: what is brighter than
/// any metal (see the header of fresnel_conductor.cpp) has no nearest finite index.
std::array<double, 2> fit(const std::array<double, kCosines>& wanted, double n0, double k0) {
  constexpr std::array<double, 2> low = {-4.6, -4.6}, high = {2.3, 3.4};
  std::array<double, 2> p = {std::log(n0), std::log(k0)};
  const auto residuals = [&](const std::array<double, 2>& q) {
    std::array<double, kCosines> r;
    for (int i = 0; i < kCosines; ++i)
      r[std::size_t(i)] = fresnel(cosine(i), std::exp(q[0]), std::exp(q[1])) - wanted[std::size_t(i)];
    return r;
  };
  const auto norm = [](const std::array<double, kCosines>& r) {
    double sum = 0;
    for (double x : r) sum += x * x;
    return sum;
  };
  std::array<double, kCosines> r = residuals(p);
  double damping = 1e-3;
  for (int step = 0; step < 200 && damping < 1e12; ++step) {
    constexpr double h = 1e-6;
    const auto a = residuals({p[0] + h, p[1]}), b = residuals({p[0], p[1] + h});
    double aa = 0, ab = 0, bb = 0, ar = 0, br = 0;
    for (std::size_t i = 0; i < kCosines; ++i) {
      const double da = (a[i] - r[i]) / h, db = (b[i] - r[i]) / h;
      aa += da * da, ab += da * db, bb += db * db, ar += da * r[i], br += db * r[i];
    }
    aa *= 1 + damping, bb *= 1 + damping;
    const double determinant = aa * bb - ab * ab;
    if (!(determinant > 0)) break;
    const std::array<double, 2> q = {std::clamp(p[0] - (bb * ar - ab * br) / determinant, low[0], high[0]),
                                     std::clamp(p[1] - (aa * br - ab * ar) / determinant, low[1], high[1])};
    const auto moved = residuals(q);
    if (norm(moved) < norm(r)) {
      const bool settled = norm(r) - norm(moved) < 1e-14 * norm(r);
      p = q;
      r = moved;
      damping /= 4;
      if (settled) break;
    } else {
      damping *= 4;
    }
  }
  return {std::exp(p[0]), std::exp(p[1])};
}

}  // namespace

double Metal::at(const std::vector<double>& values, double wavelength) const {
  const auto upper = std::clamp<std::size_t>(
      std::size_t(std::upper_bound(nm.begin(), nm.end(), wavelength) - nm.begin()), 1, nm.size() - 1);
  const double t = std::clamp((wavelength - nm[upper - 1]) / (nm[upper] - nm[upper - 1]), 0., 1.);
  return values[upper - 1] * (1 - t) + values[upper] * t;
}

Rgb<double> Metal::reflectance(double cosTheta) const {
  return rec709_of([&](double wavelength) { return fresnel(cosTheta, n_at(wavelength), k_at(wavelength)); });
}

const std::vector<Metal>& metals() {
  static const std::vector<Metal> all = published();
  return all;
}

const std::vector<ChannelIndices>& channel_indices() {
  static const auto all = [] {
    std::vector<ChannelIndices> out;
    for (const Metal& metal : metals()) {
      std::array<std::array<double, kCosines>, 3> wanted;
      for (int i = 0; i < kCosines; ++i) {
        const Rgb<double> c = metal.reflectance(cosine(i));
        wanted[0][std::size_t(i)] = c.r, wanted[1][std::size_t(i)] = c.g, wanted[2][std::size_t(i)] = c.b;
      }
      // Start from the mean index, as the eye weighs it.
      const Rgb<double> n0 = rec709_of([&](double nm) { return metal.n_at(nm); });
      const Rgb<double> k0 = rec709_of([&](double nm) { return metal.k_at(nm); });
      const std::array<std::array<double, 2>, 3> start = {{{n0.r, k0.r}, {n0.g, k0.g}, {n0.b, k0.b}}};
      ChannelIndices indices{};
      std::array<double, 3> error{};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto [n, k] = fit(wanted[c], std::max(start[c][0], 0.02), std::max(start[c][1], 0.02));
        indices.n[c] = n, indices.k[c] = k;
        for (int i = 0; i < kCosines; ++i)
          error[c] = std::max(error[c], std::abs(fresnel(cosine(i), n, k) - wanted[c][std::size_t(i)]));
      }
      indices.error = {error[0], error[1], error[2]};
      out.push_back(indices);
    }
    return out;
  }();
  return all;
}

}  // namespace brdfc::inline model
