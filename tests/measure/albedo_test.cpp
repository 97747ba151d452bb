// SPDX-License-Identifier: GPL-3.0-or-later
// Quadrature compared with closed forms, and tables compared with quadrature.
#include "measure/albedo.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "faulty.h"
#include "measure/albedo_file.h"
#include "measure/bound_model.h"
#include "measure/cubature.h"
#include "measure/guides.h"
#include "measure/probes.h"
#include "measure/tabulate_albedo.h"
#include "model/sampling.h"
#include "pictures/pictures.h"
#include "support.h"

namespace brdfc::measure {

// Not in the anonymous namespace: the model adapter has members of these types.
namespace albedo_test {

// Diffuse, except for a spike with half a percent of the light at a place that no heuristic finds.
template <class T> struct Spiked {
  static constexpr double kShare = 0.005, kHeight = 1e-6;  // fraction of the light; 1 - cosine at the spike's rim
  static ModelInfo info() {
    return {.name = "spiked", .label = "", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor&) {}
  static Vec3<T> axis() { return {T(0.6), T(0), T(0.8)}; }
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return Rgb<T>(pdf(wi, wo) / maximum(wi.z, tiny<T>())); }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T spike = select(T(1) - dot(wi, axis()) < T(kHeight), T(kShare / kHeight) / (T(2) * pi<T>()), T(0));
    return select(above(wi, wo), T(1 - kShare) * cosine_pdf(wi) + spike, T(0));
  }
  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T c = T(1) - u.y * T(kHeight / kShare), s = sqrt(maximum(T(1) - c * c, T(0)));
    const T x = s * cos(T(2) * pi<T>() * u.z), y = s * sin(T(2) * pi<T>() * u.z);
    const Vec3<T> inside{T(0.8) * x + T(0.6) * c, y, T(0.8) * c - T(0.6) * x};
    const Vec3<T> matte = sample_cosine((u.y - T(kShare)) / T(1 - kShare), u.z);
    const auto spike = u.y < T(kShare);
    const Vec3<T> wi{select(spike, inside.x, matte.x), select(spike, inside.y, matte.y),
                     select(spike, inside.z, matte.z)};
    return sample_if(above(wi, wo), wi, Rgb<T>(T(1)), pdf(wi, wo));
  }
};

}  // namespace albedo_test

namespace {

using albedo_test::Spiked;
using faulty::Faulty;

using testing::HasSubstr;

// ---- cubature --------------------------------------------------------------------------------------------

TEST(Cubature, IsExactForPolynomialsOfDegreeSeven) {
  const Integrand2 f = [](double x, double y, double* out) {
    out[0] = std::pow(x, 4) * std::pow(y, 3);
    out[1] = 1;
  };
  const CubatureResult r = integrate(f, 2, {{0, 2, 1, 3}}, {1e300, 0, 1});
  EXPECT_NEAR(r.value[0], 32. / 5 * (81 - 1) / 4, 1e-12);
  EXPECT_NEAR(r.value[1], 4, 1e-14);
  EXPECT_EQ(r.cells, 1);
}

TEST(Cubature, ReachesItsToleranceAtAKinkAndSaysWhenItCannot) {
  const Integrand2 kink = [](double x, double y, double* out) { out[0] = std::abs(x + y - 0.9); };
  // Over the unit square: 2 * 0.9^3 / 6 + (mean of x + y - 0.9 = 0.1)
  const double exact = 0.1 + std::pow(0.9, 3) / 3;
  const CubatureResult r = integrate(kink, 1, {{}}, {1e-7, 0, 100000});
  EXPECT_TRUE(r.converged);
  EXPECT_NEAR(r.value[0], exact, 1e-7);
  const CubatureResult few = integrate(kink, 1, {{}}, {1e-12, 0, 20});
  EXPECT_FALSE(few.converged);
  EXPECT_GT(few.error[0], 1e-12);
}

TEST(Cubature, PartitionCoversTheRectangleAndClosesInOnCrowds) {
  std::vector<Point2> points;
  for (int i = 0; i < 64; ++i) points.push_back({0.3 + 1e-9 * i, 0.7 - 1e-9 * (i % 8)});
  const std::vector<Rect> parts = partition({0, 1, 0, 2}, points, 4);
  double area = 0, smallest = 1;
  for (const Rect& r : parts) {
    area += (r.x1 - r.x0) * (r.y1 - r.y0);
    smallest = std::min(smallest, r.x1 - r.x0);
  }
  EXPECT_NEAR(area, 2, 1e-12);
  EXPECT_LT(smallest, 1e-7);
  // Coinciding points end the subdivision.
  EXPECT_LT(partition({0, 1, 0, 1}, std::vector<Point2>(100, {0.3, 0.3}), 4).size(), 200u);
}

TEST(Cubature, FindsAPeakFarNarrowerThanTheNodesAreApart) {
  // A pdf on the hemisphere whose location only its sampler knows.
  const Model& m = find_model("radziszewski_alda");
  const BoundModel b = bind_model(m, parse_values(m.info(), {"n=1e7", "tint=1"}));
  const Vec3<double> wo = direction(0.6, 2);
  const CubatureResult r = integrate_hemisphere(
      *b.brdf, wo, 1, [&](const Vec3<double>& wi, double* out) { out[0] = b.brdf->pdf(wi, wo); }, {1e-8, 0, 10000});
  EXPECT_TRUE(r.converged);
  EXPECT_NEAR(r.value[0], 1, 1e-7);
}

// ---- lobes -----------------------------------------------------------------------------------------------

TEST(Lobes, OfAChoiceThatDependsOnTheHalfVectorHaveNoCommonBorders) {
  const Model& model = find_model("rough_glass");
  const BoundModel b = bind_model(model, {});
  const Vec3<double> wo = direction(0.5, 1);
  EXPECT_TRUE(lobe_borders(*b.brdf, wo).empty());
  // The Fresnel equations for the half vector that these two numbers sample.
  const std::vector<double> one = lobe_borders(*b.brdf, wo, {0.2, 0.1}), two = lobe_borders(*b.brdf, wo, {0.9, 0.1});
  ASSERT_EQ(one.size(), 3u);
  ASSERT_EQ(two.size(), 3u);
  EXPECT_GT(std::abs(one[1] - two[1]), 1e-3);
}

TEST(Lobes, OfEveryModelAreTold) {
  for (const auto& [name, model] : models()) {
    const BoundModel b = bind_model(*model, {});
    for (const double c : {1., 0.6, 0.05}) {
      // Where the choice depends on the half vector, borders are known for one of them.
      const Vec3<double> wo = direction(c, 0.3);
      const bool told = !lobe_borders(*b.brdf, wo).empty() || !lobe_borders(*b.brdf, wo, {0.5, 0.5}).empty();
      EXPECT_TRUE(told) << name << " cos_theta_o=" << c;
    }
  }
}

// ---- albedo ----------------------------------------------------------------------------------------------

TEST(AlbedoValue, CountsMirrorApart) {
  const Model& m = find_model("coupled");
  const BoundModel b = bind_model(m, parse_values(m.info(), {"r0=0.2", "rm=1,0.5,0"}));
  const double c = 0.3, rf = 0.2 + 0.8 * std::pow(0.7, 5);
  const Albedo a = albedo(*b.brdf, c);
  EXPECT_NEAR(a.mirror.r, rf, 1e-15);
  EXPECT_NEAR(a.scattered.r, 1 - rf, 1e-9);
  EXPECT_NEAR(a.scattered.g, 0.5 * (1 - rf), 1e-9);
  EXPECT_NEAR(a.scattered.b, 0, 1e-15);
  EXPECT_LE(a.error, 1e-7);
}

TEST(AlbedoValue, IsGoodToItsErrorForRidgesThatAreThinAndCurved) {
  // Extreme anisotropy: the only reference is another method, the mean over many samples.
  const Model& m = find_model("ashikhmin_shirley");
  for (const auto& values : {std::vector<std::string>{"nu=1e8", "nv=1"}, {"nu=1", "nv=1e5"}, {"nu=10", "nv=1e5"}})
    for (const double c : {1., 0.5, 0.05}) {
      const BoundModel b = bind_model(m, parse_values(m.info(), values));
      const Albedo a = albedo(*b.brdf, c, 0.3, b.label);
      const MeanAlbedo mean = mean_albedos(*b.brdf, {b.brdf.get()}, c, 0.3, b.label, 1 << 19, 77);
      EXPECT_LT(a.error, 2e-3) << b.label << " cos_theta_o=" << c;
      EXPECT_NEAR(a.scattered.r, mean.scattered[0].r, 2 * a.error + 10 * mean.error) << b.label << " cos_theta_o=" << c;
    }
}

/// The mean weight of samples with independent random numbers, which does not involve cubature.
TEST(AlbedoValue, OfALobeThatIsChosenByTheHalfVectorIsTheMeanOfSamples) {
  const Model& model = find_model("rough_glass");
  for (const auto& [alpha, c] : {std::pair{0.3, 0.9}, {0.3, 0.2}, {0.6, -0.7}, {0.1, -0.75}}) {
    const BoundModel b = bind_model(model, {{"alpha", alpha}});
    const Vec3<double> wo = direction(c, 0.4);
    std::mt19937_64 random(1);
    constexpr int kSamples = 1 << 19;
    double sum = 0, squares = 0;
    for (int i = 0; i < kSamples; ++i) {
      const double w = b.brdf->sample(wo, uniform_cube(random)).weight.r;
      sum += w, squares += w * w;
    }
    const double mean = sum / kSamples, sigma = std::sqrt((squares / kSamples - mean * mean) / kSamples);
    const std::string where = fmt::format("{} cos_theta_o={}", b.label, c);
    const Albedo a = albedo(*b.brdf, c, 0.4, b.label);
    EXPECT_LT(a.error, 1e-4) << where;
    EXPECT_NEAR(a.scattered.r, mean, a.error + 5 * sigma) << where;
    for (const std::optional<double> phi : {std::optional<double>(0.4), std::optional<double>()}) {
      const MeanAlbedo m = mean_albedos(*b.brdf, {b.brdf.get()}, c, phi, b.label, 1 << 16);
      EXPECT_LT(m.error, 1e-2) << where;
      EXPECT_NEAR(m.scattered[0].r, mean, 8 * m.error + 5 * sigma) << where;
    }
  }
}

TEST(AlbedoValue, FindsAThinPeakThatHoldsLittleOfTheLight) {
  const Model& m = find_model("lossless");
  for (const char* shape : {"0.1", "1e-3"})
    for (const char* n : {"n=60", "n=1000", "n=1e4"})
      for (const double c : {1., 0.7, 0.3, 0.03}) {
        const std::string height = shape;
        const BoundModel b =
            bind_model(m, parse_values(m.info(), {"kernel=table", n, "h1=" + height, "h2=" + height, "h3=" + height}));
        const Albedo a = albedo(*b.brdf, c, 0.3, b.label);
        EXPECT_NEAR(a.scattered.r, 1, 2 * a.error) << b.label << " cos_theta_o=" << c;
        EXPECT_LT(a.error, 2e-5) << b.label << " cos_theta_o=" << c;
      }
}

TEST(AlbedoValue, AdmitsASpikeThatItMissed) {
  const detail::ModelOf<Spiked> model;
  const BoundModel b = bind_model(model, {});
  for (const double c : {1., 0.5, 0.05}) {
    const Albedo a = albedo(*b.brdf, c, 0.3, b.label);
    EXPECT_NEAR(a.scattered.r, 1, a.error) << c;
    // Nor is it spread over the whole range.
    EXPECT_LT(a.error, 0.01) << c;
  }
}

// ---- tables ----------------------------------------------------------------------------------------------

TEST(AlbedoTableOf, LambertIsOneNumberTimesItsColour) {
  const Model& m = find_model("lambert");
  const AlbedoTable t = tabulate_albedo(m);
  ASSERT_EQ(t.terms.size(), 1u);
  ASSERT_EQ(t.terms[0].size(), 1u);
  EXPECT_THAT(t.terms[0][0].colors, testing::ElementsAre("rho"));
  EXPECT_FALSE(t.terms[0][0].mirror);
  ASSERT_EQ(t.grids.size(), 1u);
  EXPECT_TRUE(t.grids[0].axes.empty());
  EXPECT_NEAR(t.grids[0].values.at(0), 1, 1e-6);
  EXPECT_LT(t.error, 1e-6);
}

TEST(AlbedoTableOf, CoupledHasTheClosedFormsTermsAndStatedError) {
  const Model& m = find_model("coupled");
  const AlbedoTable t = tabulate_albedo(m);
  ASSERT_EQ(t.terms.size(), 2u);  // schlick, dielectric
  ASSERT_EQ(t.terms[0].size(), 2u);
  EXPECT_LT(t.error, 1e-3);
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> u;
  for (int i = 0; i < 500; ++i) {
    const double r0 = u(random), c = 0.001 + 0.999 * u(random);
    const std::array<double, 3> rm{u(random), u(random), u(random)};
    const Rgb<double> a = lookup(t, m, {{"r0", r0}, {"rm", rm}}, c);
    const double rf = r0 + (1 - r0) * std::pow(1 - c, 5);
    // The stated error was measured at other random points, so it is only statistically the same.
    EXPECT_NEAR(a.r, rf + rm[0] * (1 - rf), 1.5 * t.error);
    EXPECT_NEAR(a.b, rf + rm[2] * (1 - rf), 1.5 * t.error);
  }
}

TEST(AlbedoTableOf, AshikhminShirleyAveragesTheAzimuthAndSharesGridsBetweenParts) {
  const Model& m = find_model("ashikhmin_shirley");
  const AlbedoTable t = tabulate_albedo(m);
  EXPECT_LE(t.size(), 32768u);
  EXPECT_LT(t.error, 0.05);
  EXPECT_GT(t.anisotropy, 0.01);
  EXPECT_THAT(t.doc, HasSubstr("azimuth"));
  for (const Table& g : t.grids)
    for (const TableAxis& a : g.axes) EXPECT_NE(a.name, "rotation");
  const auto& both = t.terms_for(m, parse_values(m.info(), {"part=both"}));
  const auto& specular = t.terms_for(m, parse_values(m.info(), {"part=specular"}));
  std::set<int> in_both;
  for (const AlbedoTerm& term : both) in_both.insert(term.grid);
  for (const AlbedoTerm& term : specular) EXPECT_TRUE(in_both.count(term.grid));
  // The tables of the tabulated diffuse term are 1 minus those of the specular term: no light is lost.
  const auto& same = t.terms_for(m, parse_values(m.info(), {"part=specular", "diffuse=tabulated"}));
  ASSERT_EQ(same.size(), specular.size());
  for (std::size_t i = 0; i < same.size(); ++i) EXPECT_EQ(same[i].grid, specular[i].grid);
  for (const double c : {0.05, 0.4, 1.})
    for (const char* rs : {"rs=0", "rs=0.3", "rs=1"})
      EXPECT_NEAR(lookup(t, m, parse_values(m.info(), {"diffuse=tabulated", "rd=1", "nu=7", "nv=500", rs}), c).g, 1,
                  1e-6);

  // Equal exponents in the slider's range, compared with quadrature.
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> u;
  double worst = 0;
  for (int i = 0; i < 24; ++i) {
    const double n = std::expm1(std::log1p(1e4) * u(random)), c = 0.02 + 0.98 * u(random);
    const ParamValues v{{"nu", n}, {"nv", n}, {"rs", u(random)}, {"rd", u(random)}, {"rotation", u(random)}};
    const Albedo a = albedo(*bind_model(m, v).brdf, c, 0.2, "", {1e-6, 4000, 1 << 15});
    worst = std::max(worst, std::abs(lookup(t, m, v, c).r - a.total().r));
  }
  EXPECT_LT(worst, t.error + 1e-3);
}

TEST(AlbedoTableOf, OrenNayarsColourEntersSquared) {
  const Model& m = find_model("oren_nayar");
  const AlbedoTable t = tabulate_albedo(m);
  const auto& full = t.terms_for(m, parse_values(m.info(), {"form=full"}));
  ASSERT_EQ(full.size(), 2u);
  EXPECT_THAT(full[0].colors, testing::ElementsAre("rho"));
  EXPECT_THAT(full[1].colors, testing::ElementsAre("rho", "rho"));
  EXPECT_EQ(t.terms_for(m, parse_values(m.info(), {"form=qualitative"})).size(), 1u);
}

TEST(AlbedoTableOf, AModelOfThirdDegreeInItsColoursIsRefused) {
  const detail::ModelOf<Faulty<faulty::kColorCubed>::Type> model;
  EXPECT_THAT(message([&] { tabulate_albedo(model); }), HasSubstr("of degree two at most in each"));
}

TEST(AlbedoTableOf, APdfThatIsNotTheSamplersIsRefused) {
  const detail::ModelOf<Faulty<faulty::kPdf>::Type> model;
  EXPECT_THAT(message([&] { tabulate_albedo(model); }), HasSubstr("quadrature over directions"));
}

TEST(AlbedoTableFile, HoldsTheNumbersAndTheirMeaning) {
  const Model& m = find_model("coupled");
  const AlbedoTable t = tabulate_albedo(m);
  const auto path = std::filesystem::temp_directory_path() / fmt::format("brdfc_albedo_{}.exr", ::getpid());
  write_albedo_exr(t, path.string());
  std::string reason;
  const auto in = pictures::open(path, reason);
  ASSERT_TRUE(in) << reason;
  const pictures::Header& header = in->header();
  EXPECT_TRUE(header.floating);
  ASSERT_EQ(header.height, int(t.grids.size()));
  std::vector<float> pixels(std::size_t(header.width) * std::size_t(header.height) * header.channels.size());
  ASSERT_EQ(in->read(pixels.data()), std::nullopt);
  const auto meta = nlohmann::json::parse(header.text("brdfc:table"));
  std::filesystem::remove(path);
  EXPECT_EQ(meta["model"], "coupled");
  EXPECT_EQ(meta["error"].get<double>(), t.error);
  for (std::size_t g = 0; g < t.grids.size(); ++g) {
    EXPECT_EQ(meta["grids"][g]["axes"][0]["name"], t.grids[g].axes[0].name);
    EXPECT_EQ(meta["grids"][g]["axes"][0]["values"].get<std::vector<double>>(), t.grids[g].axes[0].values);
    for (std::size_t i = 0; i < t.grids[g].values.size(); ++i)
      EXPECT_EQ(pixels[(g * std::size_t(header.width) + i) * header.channels.size()], t.grids[g].values[i]);
  }
  EXPECT_THROW(write_albedo_exr(t, "/dev/null/all.exr"), InputError);
}

}  // namespace
}  // namespace brdfc::measure
