// SPDX-License-Identifier: GPL-3.0-or-later
// What the papers state about these models in words or pictures, as numbers; including the flaws.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "core/sequence.h"
#include "measure/albedo.h"
#include "measure/bound_model.h"

namespace brdfc {
namespace {

measure::BoundModel bound(const char* name, const std::vector<std::string>& assignments) {
  const Model& m = find_model(name);
  return measure::bind_model(m, parse_values(m.info(), assignments));
}

double albedo_at(const measure::BoundModel& b, double cosTheta) {
  return measure::albedo(*b.brdf, cosTheta, 0.3, b.label).total().g;
}

void expect_albedo(const measure::BoundModel& b, double cosTheta, double wanted) {
  const measure::Albedo a = measure::albedo(*b.brdf, cosTheta, 0.3, b.label);
  EXPECT_LT(a.error, 1e-4) << b.label;
  EXPECT_NEAR(a.total().g, wanted, 1e-6 + 2 * a.error) << b.label << " cos_theta_o=" << cosTheta;
}

TEST(GlossyReflector, LostRaysHalveTheSilhouetteAndTurnedRaysDoNot) {
  // Figs. 25.5 and 25.7. Of a cosine lobe (e = 1) about r, (1 + cos theta) / 2 is above the surface.
  const measure::BoundModel lose = bound("glossy_reflector", {"kr=0.8", "e=1", "below=lose"}),
                            mirror = bound("glossy_reflector", {"kr=0.8", "e=1", "below=mirror"});
  for (const double c : {1., 0.7, 0.4, 0.1, 0.01, 1e-3}) {
    expect_albedo(lose, c, 0.8 * (1 + c) / 2);
    expect_albedo(mirror, c, 0.8);
  }
  EXPECT_NEAR(albedo_at(lose, 1e-3) / albedo_at(lose, 1), 0.5, 1e-3);
  // "Roughly 50 % at grazing incidence for all values of e."
  for (const char* e : {"e=10", "e=1000"})
    EXPECT_NEAR(albedo_at(bound("glossy_reflector", {"kr=1", "below=lose", e}), 1e-4), 0.5, 0.01) << e;
}

TEST(GlossyReflector, DensityDoublesExactlyWhereThePartnerIsBelow) {
  const measure::BoundModel lose = bound("glossy_reflector", {"e=3", "below=lose"}),
                            mirror = bound("glossy_reflector", {"e=3", "below=mirror"});
  const Vec3<double> wo = direction(0.4, 0.7), r{-wo.x, -wo.y, wo.z};
  int doubled = 0, alike = 0, none = 0;
  Sequence2 sequence(1);
  for (int i = 0; i < 2000; ++i) {
    const Point2 u = sequence.next();
    const Vec3<double> wi = direction(1 - u.x, 2 * kPi * u.y), partner = r * (2 * dot(r, wi)) - wi;
    const double once = lose.brdf->pdf(wi, wo), got = mirror.brdf->pdf(wi, wo);
    EXPECT_EQ(got, partner.z <= 0 ? 2 * once : once);
    EXPECT_EQ(dot(r, wi) <= 0, once == 0);
    ++(once == 0 ? none : partner.z <= 0 ? doubled : alike);
  }
  EXPECT_GT(doubled, 100);
  EXPECT_GT(alike, 100);
  EXPECT_GT(none, 100);
}

TEST(GlossyReflector, IsAMirrorAtTheLargestExponent) {
  const measure::BoundModel b = bound("glossy_reflector", {"kr=0.9", "e=1e7"});
  const Vec3<double> wo = direction(0.6, 1), r{-wo.x, -wo.y, wo.z};
  Sequence3 sequence(1);
  for (int i = 0; i < 1000; ++i) EXPECT_LT(length(b.brdf->sample(wo, sequence.next()).wi - r), 2e-3);
}

TEST(GlossySpecular, ScaleDecidesWhetherLightIsGained) {
  // At normal incidence the albedo is 2 pi c / (e + 2).
  for (const double e : {1., 25., 1000.}) {
    const std::string exponent = fmt::format("e={}", e);
    const auto at_normal = [&](const char* normalisation) {
      return albedo_at(bound("glossy_specular", {"ks=1", exponent, normalisation}), 1);
    };
    EXPECT_NEAR(at_normal("normalisation=book"), 2 * kPi / (e + 2), 1e-6);
    EXPECT_NEAR(at_normal("normalisation=estimator"), (e + 1) / (e + 2), 1e-6);
    EXPECT_NEAR(at_normal("normalisation=conserving"), 1, 1e-6);
    // It is never higher at other angles, because the cosine that eq. 25.7 omits is still there.
    const measure::BoundModel b = bound("glossy_specular", {"ks=1", exponent, "normalisation=conserving"});
    double before = 1 + 1e-6;
    for (int i = 19; i >= 1; --i) {
      const double a = albedo_at(b, i / 20.);
      EXPECT_LT(a, before) << e << " " << i / 20.;
      before = a;
    }
  }
}

TEST(MatteSpecular, ConstantSharesDoNotTradeWithTheAngle) {
  const measure::BoundModel b = bound("lambertian_specular", {"rd=0.8", "rs=0.05"});
  for (const double c : {1., 0.5, 0.01}) {
    EXPECT_EQ(b.brdf->mirror(direction(c, 0)).r, 0.05);
    EXPECT_NEAR(albedo_at(b, c), 0.85, 1e-9);
  }
  EXPECT_NEAR(albedo_at(bound("lambertian_specular", {"rd=0.8", "rs=0.5"}), 0.3), 1.3, 1e-9) << "nothing stops it";
}

TEST(MatteSpecular, Shirley1991IsNotReciprocal) {
  const measure::BoundModel b = bound("shirley_1991", {"r0=0.05", "rd=1"});
  const Vec3<double> high = direction(1, 0), low = direction(0.1, 2);
  // f(low, high) / f(high, low) = (1 - R(0)) / (1 - R(84 deg)).
  EXPECT_NEAR(b.brdf->eval(low, high).g / b.brdf->eval(high, low).g, 1 / (1 - std::pow(0.9, 5)), 1e-12);
  EXPECT_GT(b.brdf->eval(low, high).g / b.brdf->eval(high, low).g, 2.4);
  for (const double c : {1., 0.3, 0.01}) EXPECT_NEAR(albedo_at(b, c), 1, 1e-9);
}

TEST(MatteSpecular, SchlickDoubleGainsLightAtGrazingViews) {
  const measure::BoundModel b = bound("schlick_double", {"r0=0.05", "rd=1"});
  EXPECT_NEAR(albedo_at(b, 1), 1, 1e-3);
  double most = 0;
  for (const double c : {1., 0.5, 0.2, 0.1, 0.05, 0.01, 1e-3}) most = std::max(most, albedo_at(b, c));
  EXPECT_NEAR(most, 1.9186, 1e-4);
  EXPECT_EQ(most, albedo_at(b, 1e-3)) << "more the nearer to the horizon";
}

TEST(CoupledDielectric, LosesNothingAndHasWalshsConstant) {
  // J. W. T. Walsh's closed form of the cosine-weighted mean of Fresnel's reflectance.
  const auto mean_reflectance = [](double n) {
    const double n2 = n * n, n4 = n2 * n2, a = n2 - 1, b = n2 + 1;
    return 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) * (n + 1)) +
           n2 * a * a / (b * b * b) * std::log((n - 1) / (n + 1)) - 2 * n * n2 * (n2 + 2 * n - 1) / (b * (n4 - 1)) +
           8 * n4 * (n4 + 1) / (b * (n4 - 1) * (n4 - 1)) * std::log(n);
  };
  EXPECT_NEAR(mean_reflectance(1.5), 0.0918, 1e-4);
  double table = 0;
  for (const double n : {1.1, 1.33, 1.5, 1.8, 2.4, 4., 10., 40.}) {
    const double r0 = sqr((n - 1) / (n + 1));
    const measure::BoundModel b = bound("coupled", {"fresnel=dielectric", "rm=1", fmt::format("r0={}", r0)});
    for (const double c : {1., 0.4, 0.05, 1e-3}) expect_albedo(b, c, 1);
    const Vec3<double> normal{0, 0, 1};
    const double wanted = sqr(1 - r0) / (kPi * (1 - mean_reflectance(n)));
    table = std::max(table, std::abs(b.brdf->eval(normal, normal).g / wanted - 1));
  }
  EXPECT_LT(table, 4e-7) << "of linear interpolation in the table of the constant";
  EXPECT_GT(table, 1e-12) << "the table is not in use";
}

TEST(AshikhminShirley, Eq12WithTheTrueAlbedoLosesNothingWhereEq14LosesHalf) {
  const double stated = find_model("ashikhmin_shirley").info().properties.tabulated.error;
  EXPECT_LE(stated, 0.02);
  double worst = 0, sum = 0;
  int count = 0;
  const std::pair<const char*, const char*> exponents[] = {
      {"nu=0", "nv=0"}, {"nu=10", "nv=10"}, {"nu=10", "nv=1000"}, {"nu=1e4", "nv=1e4"}, {"nu=1e8", "nv=1e8"}};
  for (const auto& [nu, nv] : exponents)
    for (const char* rs : {"rs=0", "rs=0.05", "rs=1"}) {
      const measure::BoundModel b = bound("ashikhmin_shirley", {"diffuse=tabulated", "rd=1", rs, nu, nv});
      for (const double c : {1., 0.5, 0.174, 0.05}) {
        // By samples, because quadrature of narrow lobes takes long.
        const measure::SampledAlbedo a = measure::sampled_albedo(*b.brdf, c, 0.3, b.label, 1 << 13);
        const double off = std::abs(a.scattered.g - 1);
        EXPECT_LE(off, stated + 4 * a.standard_error) << b.label << " cos_theta_o=" << c;
        worst = std::max(worst, off);
        sum += off;
        ++count;
      }
    }
  EXPECT_LE(sum / count, 0.005);
  EXPECT_GT(worst, 1e-4) << "the tables are not in use";
  const auto at_80_degrees = [](const char* diffuse) {
    return albedo_at(bound("ashikhmin_shirley", {diffuse, "rd=1", "nu=10", "nv=10"}), std::cos(80 * kPi / 180));
  };
  EXPECT_NEAR(at_80_degrees("diffuse=paper"), 0.46, 0.01);
  EXPECT_NEAR(at_80_degrees("diffuse=tabulated"), 1, stated);
}

TEST(Coupled, Eq6IsInvertedToMachinePrecision) {
  const measure::BoundModel b = bound("coupled", {});
  double worst = 0;
  for (int i = 0; i < 4000; ++i) {
    // Up to 1, and down to where the function is 7/2 c^3.
    const double xi = i % 2 ? (i + 0.5) / 4000 : std::exp2(-i / 8.);
    const long double c = b.brdf->sample({0.6, 0, 0.8}, {0.5, xi, 0.25}).wi.z;
    const long double F = c * c * c * (3.5L - c * (5.25L - c * (4.2L - c * (1.75L - 0.3L * c))));
    const long double slope = 2.1L * c * c * (5 - c * (10 - c * (10 - c * (5 - c))));
    worst = std::max(worst, double(std::abs((F - xi) / (slope * c))));  // relative error of c
  }
  EXPECT_LT(worst, 4 * 0x1p-52);
}

/// Chandrasekhar's H by its equation 1 / H(x) = sqrt(1 - w) + w / 2 int_0^1 y H(y) / (x + y) dy, for isotropic
/// scattering (Radiative Transfer, 1950, sec. 38). Midpoints of y = t^3, since H is steep at 0.
class Chandrasekhar {
 public:
  explicit Chandrasekhar(double w) : w_(w) {
    for (int i = 0; i < kNodes; ++i) y_[i] = std::pow((i + 0.5) / kNodes, 3), h_[i] = 1;
    for (int step = 0; step < 500; ++step) {
      std::array<double, kNodes> next;
      for (int i = 0; i < kNodes; ++i) next[i] = (*this)(y_[i]);
      for (int i = 0; i < kNodes; ++i) h_[i] = (h_[i] + next[i]) / 2;
    }
  }
  double operator()(double x) const {
    double sum = 0;
    for (int i = 0; i < kNodes; ++i) {
      const double t = (i + 0.5) / kNodes;
      sum += 3 * t * t / kNodes * y_[i] * h_[i] / (x + y_[i]);
    }
    return 1 / (std::sqrt(1 - w_) + w_ / 2 * sum);
  }

 private:
  static constexpr int kNodes = 200;
  double w_;
  std::array<double, kNodes> y_, h_;
};

TEST(Disney, HasPartsThatAreOtherModels) {
  const char* color = "base_color=0.9,0.5,0.1";
  const double aspect = std::sqrt(1 - 0.9 * 0.8);
  const auto number = [](const char* name, double value) { return name + std::to_string(value); };
  const measure::BoundModel metal = bound("disney", {color, "metallic=1", "anisotropic=0.8", "masking=facets"}),
                            facets = bound("microfacet", {"f0=0.9,0.5,0.1", "masking=smith_separable",
                                                          number("ax=", 0.25 / aspect), number("ay=", 0.25 * aspect)}),
                            black = bound("disney", {"base_color=0", "roughness=0.8"}),
                            colored = bound("disney", {color, "roughness=0.8"}),
                            matte = bound("disney_diffuse", {"rho=0.9,0.5,0.1", "r=0.8"});
  Sequence2 sequence(1);
  for (int i = 0; i < 2000; ++i) {
    const auto [a, b] = sequence.next();
    const Vec3<double> wi = direction(1 - a, 7 * b), wo = direction(1 - b, 5 * a);
    const Rgb<double> f = metal.brdf->eval(wi, wo), g = facets.brdf->eval(wi, wo);
    EXPECT_NEAR(f.r, g.r, 1e-5 * (1 + g.r));
    EXPECT_NEAR(f.b, g.b, 1e-5 * (1 + g.b));
    const double below = colored.brdf->eval(wi, wo).g - black.brdf->eval(wi, wo).g;
    EXPECT_NEAR(below, matte.brdf->eval(wi, wo).g, 1e-12 * (1 + black.brdf->eval(wi, wo).g));
  }
}

TEST(Minnaert, DarkensTheRimByAPowerOfTheCosine) {
  for (const auto& [k, value] : {std::pair{"k=1", 1.}, {"k=1.3", 1.3}, {"k=3", 3.}, {"k=9", 9.}}) {
    const measure::BoundModel b = bound("minnaert", {"rho=0.6", k});
    for (const double c : {1., 0.7, 0.1, 0.01}) expect_albedo(b, c, 0.6 * std::pow(c, value - 1));
  }
}

TEST(Minnaert, BrightensTheRimLikewiseAndWithinABound) {
  const measure::BoundModel moon = bound("minnaert", {"rho=0.6", "k=0.5"});
  const auto opposite = [&](double c) { return moon.brdf->eval(direction(c, 0.3), direction(c, 0.3)).g * c; };
  for (const double c : {1., 0.7, 0.3}) {
    const double of_law = 0.6 * std::pow(c, -0.5);
    EXPECT_NEAR(albedo_at(moon, c), of_law, 0.016 * of_law) << c;
    EXPECT_LT(albedo_at(moon, c), of_law) << c;
    // Lit from the viewer, a ball is evenly bright: a full moon.
    EXPECT_NEAR(opposite(c), 0.45 / kPi, 0.02 * 0.45 / kPi) << c;
  }
  EXPECT_NEAR(opposite(0.2), 0.45 / kPi, 0.03 * 0.45 / kPi);
  EXPECT_NEAR(albedo_at(moon, 1), 0.6, 0.0055);  // seen from above
  EXPECT_LT(albedo_at(moon, 1e-4), 0.6 * std::sqrt(20));
  EXPECT_GT(albedo_at(moon, 1e-4), 0.59 * std::sqrt(20));
  // A hollow ball: each direction meets the wall at the angle at which it left it.
  double factor = 0;
  const int n = 20000;
  const measure::BoundModel white = bound("minnaert", {"rho=1", "k=0.5"});
  for (int i = 0; i < n; ++i) {
    const double c = (i + 0.5) / n;
    factor += 2 * kPi * white.brdf->eval(direction(c, 0), direction(c, 1)).g * c / n;
  }
  EXPECT_NEAR(factor, 1.43, 0.005);
}

TEST(Hapke, WithoutSurgeAndMultipleScatteringIsLommelAndSeeligersLaw) {
  const measure::BoundModel b = bound("hapke", {"w=0.6", "b=0", "b0=0", "scattering=single"});
  for (const double c : {1., 0.5, 0.1, 0.01}) {
    expect_albedo(b, c, 0.3 * (1 - c * std::log(1 + 1 / c)));
    for (const double i : {1., 0.3, 0.02})
      EXPECT_NEAR(b.brdf->eval(direction(i, 0.3), direction(c, 2)).g, 0.6 / (4 * kPi) / (i + c), 1e-12);
  }
}

TEST(Hapke, ApproximatesChandrasekharsFunctionFromBelow) {
  // Chandrasekhar's table XI.
  const Chandrasekhar conservative(1);
  for (const auto& [x, h] : {std::pair{0.1, 1.24735}, {0.2, 1.45035}, {0.5, 2.01278}, {1.0, 2.90781}})
    EXPECT_NEAR(conservative(x), h, 4e-5 * h) << x;
  double worst = 0;
  for (const double w : {0.1, 0.5, 0.9, 0.99, 1.0}) {
    const Chandrasekhar H(w);
    const std::string colour = fmt::format("w={}", w);
    const measure::BoundModel all = bound("hapke", {colour, "b=0", "b0=0"}),
                              once = bound("hapke", {colour, "b=0", "b0=0", "scattering=single"});
    for (const double x : {0.01, 0.1, 0.3, 0.6, 1.0}) {
      const Vec3<double> wi = direction(x, 0.3), wo = direction(x, 2);
      const double again = all.brdf->eval(wi, wo).g / once.brdf->eval(wi, wo).g - 1;  // H^2 - 1
      const double below = 1 - std::sqrt(1 + again) / H(x);
      EXPECT_GT(below, -1e-4) << all.label << " x=" << x;
      worst = std::max(worst, below);
      // With the true H the albedo is 1 - sqrt(1 - w) H.
      const double lost = 1 - albedo_at(all, x) / (1 - std::sqrt(1 - w) * H(x));
      EXPECT_GT(lost, -1e-4) << all.label << " x=" << x;
      EXPECT_LT(lost, 0.02) << all.label << " x=" << x;
      if (w == 1) {
        EXPECT_GT(lost, 0.005) << x;
        EXPECT_LT(lost, 0.0145) << x;
      }
    }
  }
  EXPECT_GT(worst, 0.008);
  EXPECT_LT(worst, 0.0098);
}

}  // namespace
}  // namespace brdfc
