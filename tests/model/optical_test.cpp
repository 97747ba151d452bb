// SPDX-License-Identifier: GPL-3.0-or-later
// Spectra, substances with measured n and k, and their approximation by an index for each channel, compared with
// published numbers and with the spectral integral.
#include "model/optical.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>

#include "measure/albedo.h"
#include "measure/bound_model.h"

namespace brdfc {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(Spectrum, EachOfXyzIsAMean) {
  for (const double x : xyz_of([](double) { return 0.7; })) EXPECT_NEAR(x, 0.7, 1e-14);
  // The fraction of D65's luminance beyond 555 nm; Z is 0 there.
  const Xyz red = xyz_of([](double nm) { return nm > 600 ? 1. : 0.; });
  EXPECT_GT(red[0], 0.3);
  EXPECT_LT(red[2], 1e-4);
}

/// X, Y and Z of white, from D65's chromaticity.
constexpr double kWhiteX = 0.3127 / 0.3290, kWhiteZ = (1 - 0.3127 - 0.3290) / 0.3290;

std::array<double, 3> rec709(const Xyz& xyz) {
  const double X = xyz[0] * kWhiteX, Y = xyz[1], Z = xyz[2] * kWhiteZ;
  return {3.2409699 * X - 1.5373832 * Y - 0.4986108 * Z, -0.9692436 * X + 1.8759675 * Y + 0.0415551 * Z,
          0.0556301 * X - 0.2039770 * Y + 1.0569715 * Z};
}

std::array<double, 3> rec2020(const Xyz& xyz) {
  const double X = xyz[0] * kWhiteX, Y = xyz[1], Z = xyz[2] * kWhiteZ;
  return {1.7166512 * X - 0.3556708 * Y - 0.2533663 * Z, -0.6666844 * X + 1.6164812 * Y + 0.0157685 * Z,
          0.0176399 * X - 0.0427706 * Y + 0.9421031 * Z};
}

/// Uses X, Y and Z themselves as channels.
std::array<double, 3> as_it_is(const Xyz& xyz) { return xyz; }

const Substance& substance(const std::string& name) {
  for (const Substance& s : substances())
    if (s.name == name) return s;
  throw InputError(name);
}

TEST(Substances, AreMeasuredAndHaveASource) {
  EXPECT_GE(substances().size(), 15u);
  for (const Substance& s : substances()) {
    EXPECT_THAT(s.source, HasSubstr("refractiveindex.info: ")) << s.name;
    EXPECT_NE(s.label, s.name);
  }
  EXPECT_EQ(substance("copper").n.at(548.6), 1.02);  // Johnson and Christy's table
  EXPECT_EQ(substance("copper").k.at(548.6), 2.577);
  EXPECT_NEAR(substance("aluminium").reflectance(1)[1], 0.914, 0.003);
  // SCHOTT's data sheets: n_d 1.51680, 1.78472; Abbe numbers 64.17, 25.68.
  EXPECT_NEAR(substance("bk7").index_d(), 1.5168, 2e-5);
  EXPECT_NEAR(substance("bk7").abbe(), 64.17, 0.1);
  EXPECT_NEAR(substance("sf11").index_d(), 1.78472, 5e-5);
  EXPECT_NEAR(substance("sf11").abbe(), 25.68, 0.05);
  for (const char* name : {"gold", "iron", "titanium"}) EXPECT_TRUE(substance(name).conductor());
  for (const char* name : {"water", "diamond", "bk7"}) EXPECT_FALSE(substance(name).conductor());
}

/// Prints the error of a channel's index relative to the spectrum, and that of Schlick's formula.
TEST(Substances, AnIndexStandsForAChannel) {
  std::printf("largest error of the reflectance over all angles: index, Schlick's formula from R_0\n");
  for (const Substance& s : substances())
    for (const bool wide : {false, true}) {
      const ToRgb to_rgb = wide ? rec2020 : rec709;
      const OpticalValues v = optical_values(s, to_rgb);
      double own = 0, schlick = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const bool outside = v.unclipped[c] > kBrightest;
        // Exact at normal incidence.
        EXPECT_NEAR(fresnel_conductor(1., 0., v.n[c], v.k[c]), std::min(v.unclipped[c], kBrightest), 1e-9) << s.name;
        EXPECT_EQ(outside, s.name == "gold" && !wide && c == 0) << "gold is outside of Rec.709; " << s.name << " " << c;
        if (outside) continue;
        for (int j = 1; j <= 300; ++j) {
          const double cosine = j / 300., sin2 = (1 - cosine) * (1 + cosine), truth = to_rgb(s.reflectance(cosine))[c];
          own = std::max(own, std::abs(fresnel_conductor(cosine, sin2, v.n[c], v.k[c]) - truth));
          schlick =
              std::max(schlick, std::abs(v.unclipped[c] + (1 - v.unclipped[c]) * std::pow(1 - cosine, 5) - truth));
        }
      }
      std::printf("  %-10s %s  %.5f  %.4f   R_0 %.4f %.4f %.4f\n", s.name.c_str(), wide ? "Rec.2020" : "Rec.709 ", own,
                  schlick, v.unclipped[0], v.unclipped[1], v.unclipped[2]);
      EXPECT_LT(own, s.name == "copper" && !wide ? 5.5e-3 : 3e-3) << s.name;
      // Schlick's formula lacks the dip that metals with large k have near grazing angles.
      if (s.name == "aluminium" || s.name == "iron" || s.name == "chromium") {
        EXPECT_GT(schlick, 0.1) << s.name;
      }
    }
}

TEST(Substances, OfOneIndexKeepIt) {
  const std::vector<double> nm = {400, 700};
  for (const double n : {0.2, 1.33, 1.5, 2.4})
    for (const double k : {0., 0.5, 3.}) {
      if (n < 1 && k == 0) continue;  // here only the range beyond the critical angle distinguishes n from 1 / n
      const OpticalValues v = optical_values({"", "", "", {nm, {n, n}}, {nm, {k, k}}}, as_it_is);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(v.n[c], n, 2e-4) << n << " " << k;
        EXPECT_NEAR(v.k[c], k, 2e-4) << n << " " << k;
      }
    }
}

TEST(Substances, SetWhatAModelHas) {
  const auto set = [](const char* model, const char* name) {
    return parameters_of(find_model(model).info(), substance(name), rec709);
  };
  EXPECT_EQ(set("fresnel_conductor", "gold").size(), 6u);
  EXPECT_NEAR(std::get<double>(set("fresnel_dielectric", "water").at("ior")), 1.3325, 1e-4);
  EXPECT_NEAR(std::get<double>(set("coupled", "bk7").at("r0")), 0.0422, 2e-4);
  EXPECT_EQ((std::get<std::array<double, 3>>(set("cook_torrance", "gold").at("f0"))[0]), 1) << "a colour ends at 1";
  EXPECT_EQ(set("radziszewski_alda", "gold").count("tint"), 1u);
  EXPECT_EQ(set("radziszewski_alda", "bk7").count("ior"), 1u);
  EXPECT_EQ(set("radziszewski_alda", "bk7").count("tint"), 0u);
  for (const auto& [model, name] : {std::pair{"glass", "gold"}, std::pair{"lambert", "water"}}) {
    try {
      set(model, name);
      ADD_FAILURE() << model << " " << name;
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), AllOf(HasSubstr(model), HasSubstr(name[0] == 'g' ? "which metal" : "which glass")));
    }
  }
  // The model accepts the values, and reflects the substance's colour.
  const measure::BoundModel b =
      measure::bind_model(find_model("fresnel_conductor"), set("fresnel_conductor", "silver"));
  const auto expected = rec709(substance("silver").reflectance(0.5));
  const Rgb<double> got = b.brdf->mirror(direction(0.5, 1));
  EXPECT_NEAR(got.r, expected[0], 1e-3);
  EXPECT_NEAR(got.b, expected[2], 1e-3);
}

/// Compared with measurements, at the channels' wavelengths.
TEST(Dispersion, CauchysSeriesIsThatOfGlassWaterAndGems) {
  for (const char* name : {"bk7", "f2", "sf11", "silica", "water", "sapphire", "diamond"}) {
    const Substance s = find_substance(name, ".");
    const std::array<double, 3> n = dispersed(s.index_d(), kDispersion / s.abbe());
    for (std::size_t c = 0; c < 3; ++c) {
      std::printf("%s at %.1f nm: %.5f, measured %.5f\n", name, kChannelNm[c], n[c], s.n.at(kChannelNm[c]));
      EXPECT_NEAR(n[c], s.n.at(kChannelNm[c]), 0.15 * (s.n.at(kLineF) - s.n.at(kLineC))) << name << " " << c;
    }
    EXPECT_LT(n[0], n[1]) << name;
    EXPECT_LT(n[1], n[2]) << name;
  }
}

TEST(Dispersion, WithoutItAllChannelsHaveTheIndex) {
  for (const double index : {0.1, 1.0, 1.5, 10.0}) EXPECT_EQ(dispersed(index, 0.0), (std::array{index, index, index}));
  // At the end of the accepted range, no index is 0.
  for (const double n : dispersed(0.1, 2.0)) EXPECT_GT(n, 0);
}

TEST(Dispersion, EachChannelIsRefractedByItsIndex) {
  for (const char* name : {"glass", "fresnel_dielectric"}) {
    const Model& m = find_model(name);
    const Vec3<double> wo = direction(0.6, 0.2);
    for (const double dispersion : {0.0, 0.8}) {
      const auto brdf = m.make_double({{"ior", 1.7}, {"dispersion", dispersion}});
      const std::array<double, 3> n = brdf->channel_iors();
      const ClosureSum<double> sum = *brdf->exact(wo);
      ASSERT_EQ(sum.size(), 4u);
      Rgb<double> all(0);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_EQ(sum[c + 1].kind, ClosureKind::Refraction);
        EXPECT_EQ(sum[c + 1].ior, n[c]);
        all += sum[c + 1].weight;
      }
      const Rgb<double> through = brdf->transmit(wo);
      EXPECT_THAT((std::array{all.r, all.g, all.b}), testing::ElementsAre(through.r, through.g, through.b));
      EXPECT_EQ(sum[1].weight.r > 0, dispersion > 0);
      EXPECT_EQ(sum[1].weight.g, 0);
      EXPECT_EQ(sum[2].weight.r > 0, dispersion == 0);
      EXPECT_EQ(sum[3].weight.b > 0, dispersion > 0);
      // By the Fresnel equations for that channel alone.
      for (std::size_t c = 0; c < 3; ++c) {
        const auto alone = m.make_double({{"ior", n[c]}});
        EXPECT_DOUBLE_EQ((std::array{through.r, through.g, through.b}[c]), alone->transmit(wo).g);
      }
    }
  }
}

}  // namespace
}  // namespace brdfc
