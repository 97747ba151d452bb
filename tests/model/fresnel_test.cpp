// SPDX-License-Identifier: GPL-3.0-or-later
// Fresnel's equations, spectra of metals and the models built on them, against published numbers and the spectral
// integral. Values of arbitrary precision are in golden.csv.
#include "model/fresnel.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <complex>

#include "measure/albedo.h"
#include "measure/bound_model.h"
#include "model/metals.h"
#include "model/spectrum.h"

namespace brdfc {
namespace {

double max_abs(const Rgb<double>& c) { return std::max({std::abs(c.r), std::abs(c.g), std::abs(c.b)}); }

TEST(Spectrum, GreyIsGreyAndEqualEnergyHasItsKnownColour) {
  const Rgb<double> white = rec709_of([](double) { return 1.; });
  EXPECT_NEAR(max_abs(white - Rgb<double>(1.)), 0, 1e-12);
  // Monochromatic bands: the dominant channel, and a negative share outside of the gamut.
  const auto band = [](double from, double to) {
    return rec709_of([&](double nm) { return nm >= from && nm < to ? 1. : 0.; });
  };
  EXPECT_GT(band(600, 780).r, 0.7);
  EXPECT_LT(band(490, 510).r, 0);
  EXPECT_GT(band(380, 490).b, 0.8);
  // Additive: bands tile the spectrum.
  EXPECT_NEAR(max_abs(band(380, 500) + band(500, 600) + band(600, 900) - Rgb<double>(1.)), 0, 1e-12);
}

/// The textbook form with complex numbers, in long double.
double textbook_conductor(double c, double n, double k) {
  using C = std::complex<long double>;
  const C eta(n, k), cosine(c), root = std::sqrt(eta * eta - C(1) + cosine * cosine);
  const C rs = (cosine - root) / (cosine + root), rp = (eta * eta * cosine - root) / (eta * eta * cosine + root);
  return double((std::norm(rs) + std::norm(rp)) / 2);
}

TEST(Fresnel, ConductorEqualsTheComplexFormula) {
  for (const double n : {0.04, 0.5, 1., 1.5, 4., 50.})
    for (const double k : {0., 1e-6, 0.3, 2., 7., 60.})
      for (int i = 1; i <= 50; ++i) {
        const double c = i / 50., expected = textbook_conductor(c, n, k);
        EXPECT_NEAR(fresnel_conductor(c, (1 - c) * (1 + c), n, k), expected, 1e-13 + 1e-9 * expected)
            << c << " " << n << " " << k;
      }
}

TEST(Fresnel, DielectricEqualsTheConductorWithoutAbsorptionAndLosesNothing) {
  for (const double eta : {0.4, 1 / 1.5, 0.999999, 1., 1.000001, 1.33, 1.5, 2.4})
    for (int i = 1; i <= 50; ++i) {
      const double c = i / 50., s2 = (1 - c) * (1 + c);
      const Dielectric<double> f = fresnel_dielectric(c, s2, eta);
      EXPECT_NEAR(f.reflected, textbook_conductor(c, eta, 0), 1e-12) << c << " " << eta;
      EXPECT_NEAR(f.reflected + f.refracted, 1, 1e-14) << c << " " << eta;
    }
  EXPECT_NEAR(fresnel_dielectric(1., 0., 1.5).reflected, 0.04, 1e-16);
  const double brewster = std::atan(1.5);
  EXPECT_NEAR(fresnel_dielectric(std::cos(brewster), sqr(std::sin(brewster)), 1.5).reflected,
              0.5 * sqr(std::sin(std::atan(1.5) - std::atan(1 / 1.5))), 1e-15);
  EXPECT_EQ(fresnel_dielectric(0.6, 0.64, 1 / 1.5).reflected, 1);  // beyond the critical angle
  EXPECT_EQ(fresnel_dielectric(0.6, 0.64, 1 / 1.5).refracted, 0);
}

TEST(Metals, ReflectWhatIsPublishedAtTheirMeasuredWavelengths) {
  const auto normal = [](const char* name, double nm) {
    for (const Metal& m : metals())
      if (m.name == name) return fresnel_conductor(1., 0., m.n_at(nm), m.k_at(nm));
    throw InputError(name);
  };
  // R = ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2) of the published pairs.
  EXPECT_NEAR(normal("cu", 548.6), (sqr(0.02) + sqr(2.577)) / (sqr(2.02) + sqr(2.577)), 1e-14);
  EXPECT_NEAR(normal("ag", 616.8), (sqr(0.94) + sqr(4.152)) / (sqr(1.06) + sqr(4.152)), 1e-14);
  EXPECT_NEAR(normal("al", 563.57), 0.915, 0.002);
}

/// Prints the error of three channels against the spectrum, and Schlick's beside it.
TEST(Metals, ThreeIndicesStandForTheSpectrum) {
  std::printf("largest error of the reflectance in r, g, b: three indices, Schlick's formula from R_0\n");
  for (std::size_t i = 0; i < metals().size(); ++i) {
    const Metal& m = metals()[i];
    const Rgb<double> r0 = m.reflectance(1);
    Rgb<double> schlick(0), own(0);
    const ChannelIndices& index = channel_indices()[i];
    // Between the cosines of the fit, too.
    for (int j = 1; j <= 300; ++j) {
      const double c = j / 300., s2 = (1 - c) * (1 + c);
      const Rgb<double> truth = m.reflectance(c);
      const Rgb<double> guess = r0 + (Rgb<double>(1.) - r0) * std::pow(1 - c, 5);
      const auto R = [&](std::size_t k) { return fresnel_conductor(c, s2, index.n[k], index.k[k]); };
      const auto worst = [](double& w, double d) { w = std::max(w, std::abs(d)); };
      worst(schlick.r, guess.r - truth.r), worst(schlick.g, guess.g - truth.g), worst(schlick.b, guess.b - truth.b);
      worst(own.r, R(0) - truth.r), worst(own.g, R(1) - truth.g), worst(own.b, R(2) - truth.b);
    }
    std::printf("  %-9s  %.5f %.5f %.5f   %.4f %.4f %.4f   R_0 %.4f %.4f %.4f\n", m.label.c_str(), own.r, own.g, own.b,
                schlick.r, schlick.g, schlick.b, r0.r, r0.g, r0.b);
    const bool gold = m.name == "au";
    EXPECT_LT(own.r, gold ? 0.037 : 3e-3) << m.label;
    EXPECT_LT(std::max(own.g, own.b), 1.5e-3) << m.label;
    if (gold) {
      EXPECT_GT(r0.r, 1.02) << "gold is outside of Rec.709";
    }
    // Schlick's formula misses the dip that metals with large k have before grazing.
    if (m.name == "al" || m.name == "fe" || m.name == "cr") {
      EXPECT_GT(max_abs(schlick), 0.1) << m.label;
      EXPECT_LT(max_abs(own), max_abs(schlick) / 50) << m.label;
    }
  }
}

TEST(Metals, TheModelIsItsThreeIndices) {
  const Model& model = find_model("fresnel_conductor");
  EXPECT_FALSE(model.has_scatter());
  for (std::size_t i = 0; i < metals().size(); ++i) {
    const measure::BoundModel b = measure::bind_model(model, {{"metal", metals()[i].name}});
    for (const double c : {1., 0.5, 0.05}) {
      const Rgb<double> d = b.brdf->mirror(direction(c, 1)) - metals()[i].reflectance(c);
      EXPECT_LT(max_abs(d), metals()[i].name == "au" ? 0.037 : 3e-3) << b.label << " " << c;
    }
  }
}

TEST(Metals, SchlicksErrorForDielectricsIsAsTheyReport) {
  // Against the full equations over all angles; the approximation was made for these.
  const auto error = [](double eta) {
    const double r0 = sqr((eta - 1) / (eta + 1));
    double worst = 0;
    for (int j = 1; j <= 1000; ++j) {
      const double c = j / 1000., s2 = (1 - c) * (1 + c);
      worst = std::max(worst, std::abs(r0 + (1 - r0) * std::pow(1 - c, 5) - fresnel_dielectric(c, s2, eta).reflected));
    }
    return worst;
  };
  std::printf("largest error of Schlick's formula: water %.4f, glass %.4f, diamond %.4f\n", error(1.33), error(1.5),
              error(2.42));
  EXPECT_LT(error(1.5), 0.04);
  EXPECT_GT(error(1.5), 0.005);
}

}  // namespace
}  // namespace brdfc
