// SPDX-License-Identifier: GPL-3.0-or-later
// Kernels given by curves with any number of points, and the four heights that approximate them.
#include <gtest/gtest.h>

#include <cmath>

#include "measure/albedo.h"
#include "measure/kernel_fit.h"

namespace brdfc::measure {
namespace {

KernelCurve sech2(double end, int count) {
  KernelCurve c;
  for (int i = 0; i < count; ++i) {
    c.u.push_back(end * i / (count - 1));
    c.k.push_back(1 / sqr(std::cosh(c.u.back())));
  }
  return c;
}

double number(const KernelFit& fit, const char* name) { return std::get<double>(fit.values.at(name)); }

const double kCosines[] = {1, 0.95, 0.71, 0.7, 0.3, 0.05, 0.001};

TEST(KernelLobeOf, FourPointsIsTheModel) {
  const Model& m = find_model("lossless");
  for (const double n : {0.3, 4., 60., 1e4}) {
    const auto lobe = kernel_lobe({{0, 1, 2, 3}, {2, 1.8, 0.4, 0.6}}, n);
    const auto model =
        m.make_double({{"kernel", std::string("table")}, {"n", n}, {"h0", 1.}, {"h1", 0.9}, {"h2", 0.2}, {"h3", 0.3}});
    for (const double o : kCosines) {
      const Vec3<double> wo = direction(o, 1);
      for (const double i : kCosines) {
        const double want = model->eval(direction(i, 2), wo).r;
        EXPECT_NEAR(lobe.eval(direction(i, 2), wo).r, want, 1e-12 * want) << n << " " << i << " " << o;
      }
      for (const double u : {0.01, 0.4, 0.99})
        EXPECT_NEAR(lobe.sample(wo, {0, u, 0}).wi.z, model->sample(wo, {0, u, 0}).wi.z, 1e-12) << n << " " << o;
    }
  }
}

TEST(KernelLobeOf, ManyPointsOfSech2IsItsClosedForm) {
  const Model& m = find_model("lossless");
  for (const double n : {0.5, 4., 20.}) {
    const auto lobe = kernel_lobe(sech2(n, 4001), n);
    const auto model = m.make_double({{"n", n}});
    for (const double o : kCosines)
      for (const double i : kCosines) {
        // The error of a chord of length h is at most h^2 / 12 times the second derivative, which is at most 4 times
        // the value.
        const double want = model->eval(direction(i, 2), direction(o, 1)).r;
        EXPECT_NEAR(lobe.eval(direction(i, 2), direction(o, 1)).r, want, 2 * sqr(n / 4000) * want + 1e-15)
            << n << " " << i << " " << o;
      }
  }
}

TEST(KernelLobeOf, UnevenPointsLosesNothingAndIsSampled) {
  const KernelCurve curve{{0.2, 0.25, 1, 3.5, 70}, {0.3, 5, 0.7, 0.7, 0.01}};
  for (const double n : {0.6, 5., 90.})
    for (const double cosine : {1., 0.6, 0.05}) {
      const auto lobe = kernel_lobe(curve, n);
      const Vec3<double> wo = direction(cosine, 0);
      // The fraction of light below x = cos^2 theta_i, and the random numbers that give those x.
      constexpr int kSteps = 20000, kStops = 8;
      const auto drawn = [&](double u) { return sqr(lobe.sample(wo, {0, u, 0}).wi.z); };
      const bool rising = drawn(0.25) < drawn(0.75);
      double sum = 0, end = 0;
      for (int stop = 1; stop <= kStops; ++stop) {
        const double u = double(stop) / kStops, start = end;
        end = stop == kStops ? 1 : drawn(rising ? u : 1 - u);
        for (int i = 0; i < kSteps / kStops; ++i) {
          const double x = start + (end - start) * (i + 0.5) / (kSteps / kStops);
          sum += kPi * lobe.eval(direction(std::sqrt(x), 1), wo).r * (end - start) / (kSteps / kStops);
        }
        EXPECT_NEAR(sum, u, 2e-6) << n << " " << cosine;
      }
    }
}

TEST(KernelFitOf, ADrawnModelGivesItBack) {
  // Also if the curve is stretched, scaled, or has points that change nothing.
  const KernelCurve curves[] = {{{0, 1, 2, 3}, {1, 0.9, 0.2, 0.3}},
                                {{0, 0.5, 1, 1.5}, {2, 1.8, 0.4, 0.6}},
                                {{0, 7, 14, 21, 22}, {10, 9, 2, 3, 3}},
                                {{0, 0.5, 1, 1.25, 2, 3}, {1, 0.95, 0.9, 0.725, 0.2, 0.3}}};
  const double stretch[] = {1, 0.5, 7, 1};
  for (int i = 0; i < 4; ++i)
    for (const double n : {30., 400.}) {
      const KernelFit fit = fit_kernel(curves[i], n);
      EXPECT_NEAR(number(fit, "n"), n / stretch[i], 1e-5 * n) << i;
      EXPECT_NEAR(number(fit, "h0"), 1, 1e-5) << i;
      EXPECT_NEAR(number(fit, "h1"), 0.9, 1e-5) << i;
      EXPECT_NEAR(number(fit, "h2"), 0.2, 1e-5) << i;
      EXPECT_NEAR(number(fit, "h3"), 0.3, 1e-5) << i;
      // Six digits.
      EXPECT_LT(fit.kernel, 2e-5) << i;
      EXPECT_LT(fit.l1, 2e-5) << i;
    }
}

TEST(KernelFitOf, StatesTheErrorThatSamplesFind) {
  struct Case {
    KernelCurve curve;
    double n;
  };
  // The last one has a peak with little of the light.
  for (const auto& [curve, n] :
       {Case{sech2(5, 50), 4}, Case{sech2(5, 50), 300}, Case{{{0, 0.01, 10}, {1, 0.1, 0.05}}, 4}}) {
    const KernelFit fit = fit_kernel(curve, n);
    const auto truth = kernel_lobe(curve, n);
    const auto model = find_model("lossless").make_double(fit.values);
    double worst = 0, mean = 0;
    for (int view = 0; view < 8; ++view) {
      const Vec3<double> wo = direction(std::sqrt((view + 0.5) / 8), 0);
      // Both are lossless, so the deficit of one is half of the difference.
      double difference = 0;
      constexpr int kSamples = 1024;
      for (int i = 0; i < kSamples; ++i) {
        const Sample<double> s = truth.sample(wo, {0, (i + 0.5) / kSamples, 0});
        difference += 2 * std::max(1 - model->pdf(s.wi, wo) / s.pdf, 0.) / kSamples;
      }
      worst = std::max(worst, difference);
      mean += difference / 8;
    }
    EXPECT_NEAR(fit.l1, mean, 0.02 * mean + 1e-6) << n;
    EXPECT_NEAR(fit.l1_view, worst, 0.02 * worst + 1e-6) << n;
    double kernel = 0;
    DrawnKernel<double, EvenKnots<double, 4>> four;
    four.heights = {number(fit, "h0"), number(fit, "h1"), number(fit, "h2"), number(fit, "h3")};
    for (int i = 0; i <= 200000; ++i) {
      const double u = n * i / 200000;
      kernel = std::max(kernel, std::abs(four.k(u * number(fit, "n") / n) / truth.drawn.k(u) - 1));
    }
    EXPECT_NEAR(fit.kernel, kernel, 0.01 * kernel + 1e-12) << n;
  }
}

}  // namespace
}  // namespace brdfc::measure
