// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/spectrum.h"

#include <cmath>

namespace brdfc::inline model {
namespace {

/// Relative power of D65 from 380 to 780 nm in steps of 10 nm; linear in between, as CIE 15 asks.
constexpr std::array<double, 41> kD65 = {
    49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923,
    108.811, 109.354, 107.802, 104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880, 88.6856,
    90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091,
    74.3490, 61.6040, 69.8856, 75.0870, 63.5927, 46.4182, 66.8054, 63.3828};

double d65(int nm) {
  const auto i = std::size_t(nm - 380) / 10;
  const double t = (nm - 380) % 10 / 10.;
  return t > 0 ? kD65[i] * (1 - t) + kD65[i + 1] * t : kD65[i];
}

/// A bell with different widths on its two sides.
double bell(double nm, double peak, double left, double right) {
  const double t = (nm - peak) / (nm < peak ? left : right);
  return std::exp(-0.5 * t * t);
}

}  // namespace

const std::array<Rgb<double>, kWavelengths>& rec709_weights() {
  static const auto weights = [] {
    std::array<Rgb<double>, kWavelengths> w;
    Rgb<double> sum(0);
    for (std::size_t i = 0; i < kWavelengths; ++i) {
      const int nm = kWavelengthMin + int(i) * kWavelengthStep;
      const double x = 1.056 * bell(nm, 599.8, 37.9, 31.0) + 0.362 * bell(nm, 442.0, 16.0, 26.7) -
                       0.065 * bell(nm, 501.1, 20.4, 26.2);
      const double y = 0.821 * bell(nm, 568.8, 46.9, 40.5) + 0.286 * bell(nm, 530.9, 16.3, 31.1);
      const double z = 1.217 * bell(nm, 437.0, 11.8, 36.0) + 0.681 * bell(nm, 459.0, 26.0, 13.8);
      // XYZ to Rec.709, from its primaries and D65 (ITU-R BT.709).
      w[i] = Rgb<double>(3.2404542 * x - 1.5371385 * y - 0.4985314 * z, -0.9692660 * x + 1.8760108 * y + 0.0415560 * z,
                         0.0556434 * x - 0.2040259 * y + 1.0572252 * z) *
             d65(nm);
      sum += w[i];
    }
    for (Rgb<double>& v : w) v = {v.r / sum.r, v.g / sum.g, v.b / sum.b};
    return w;
  }();
  return weights;
}

Rgb<double> rec709_of(const std::function<double(double nm)>& reflectance) {
  Rgb<double> out(0);
  for (std::size_t i = 0; i < kWavelengths; ++i)
    out += rec709_weights()[i] * reflectance(kWavelengthMin + double(i) * kWavelengthStep);
  return out;
}

}  // namespace brdfc::inline model
