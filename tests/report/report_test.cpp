// SPDX-License-Identifier: GPL-3.0-or-later
// The report's measurements, of pictures whose error and noise are known by construction.
#include "report/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "core/error.h"
#include "reference/color.h"
#include "reference/image.h"

namespace brdfc::report {
namespace {

using reference::Image;
using reference::Rendering;

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr int kSize = 64;
constexpr float kNoise = 0.05f;

/// A gradient in [0.2, 0.8], `factor` times as bright, with Gaussian noise.
Rendering picture(double factor, float noise, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0, noise > 0 ? noise : 1);
  Rendering out;
  out.mean = Image(kSize, kSize);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      for (int c = 0; c < 3; ++c)
        out.mean.pixel(x, y)[c] = float(factor * (0.2 + 0.6 * x / (kSize - 1))) + (noise > 0 ? normal(random) : 0.0f);
  return out;
}

Rendering reference() {
  Rendering out = picture(1, 0, 0);
  out.variance = Image(kSize, kSize);
  return out;
}

class ReportTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("brdfc-report-") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "ball");
    reference::write_rendering(folder_ / "ball/reference.exr", reference());
    for (unsigned i = 0; i < 4; ++i) {
      reference::write_rendering(folder_ / fmt::format("ball/glossy-{}.exr", i), picture(1.1, kNoise, 10 + i));
      reference::write_rendering(folder_ / fmt::format("ball/exact-{}.exr", i), picture(1, kNoise, 20 + i));
    }
    runs_ = json::parse(R"({
      "format": 1, "scene": "ball", "description": "a <ball> & more",
      "settings": {"width": 64, "height": 64, "max_bounces": 4},
      "reference": {"image": "reference.exr", "spp": 1024, "wall_seconds": 2.5},
      "runs": [
        {"form": "glossy", "spp": 16, "images": ["glossy-0.exr", "glossy-1.exr", "glossy-2.exr", "glossy-3.exr"],
         "cpu_seconds": [1.0, 2.0, 1.0, 1.0], "wall_seconds": [1, 1, 1, 1], "materials": []},
        {"form": "exact", "spp": 16, "images": ["exact-0.exr", "exact-1.exr", "exact-2.exr", "exact-3.exr"],
         "cpu_seconds": [1.5, 3.0, 1.5, 9.0], "wall_seconds": [1, 1, 1, 1],
         "materials": [
           {"id": "a", "model": "coupled", "representation": "exact", "closures": 3,
            "error": {"relative_l1": 1e-5, "albedo": 1e-6}},
           {"id": "b", "model": "lambert", "representation": "exact", "closures": 1, "error": null}]}],
      "provenance": {"Blender": "4.5.15"}, "commands": ["brdfc render ball.json"]})");
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::vector<SceneReport> load() {
    std::ofstream(folder_ / "ball/runs.json") << runs_;
    return load_report(folder_);
  }
  std::string load_error() {
    try {
      load();
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  }

  fs::path folder_;
  json runs_;
};

TEST_F(ReportTest, SeparatesErrorFromNoise) {
  const auto scenes = load();
  ASSERT_EQ(scenes.size(), 1u);
  const FormReport &glossy = scenes[0].forms[0], &exact = scenes[0].forms[1];
  EXPECT_NEAR(glossy.difference.bias, 0.1, 5 * glossy.difference.bias_error);
  EXPECT_GT(glossy.difference.rel_mse, 2 * glossy.difference.noise);
  EXPECT_NEAR(exact.difference.bias, 0, 5 * exact.difference.bias_error);
  EXPECT_NEAR(exact.difference.rel_mse / exact.difference.noise, 1, 0.05);
  // With four pictures, the standard deviation of a pixel is half that of one picture. Then the mean over all pixels:
  // the channels are assumed to be correlated, so there are twice as many products of deviations as squares; and the
  // standard deviation estimated from four normal numbers is on average sqrt(8 / (3 pi)) of the true one.
  EXPECT_NEAR(exact.difference.bias_error, kNoise / 2 / kSize / 0.5 * std::sqrt((1 + 2 * 8 / (3 * kPi)) / 3), 2e-5);
  EXPECT_EQ(exact.spp, 64);
}

TEST_F(ReportTest, RelMseOfKnownPictures) {
  runs_["runs"].erase(1);
  runs_["runs"][0]["images"] = {"brighter.exr"};
  runs_["runs"][0]["cpu_seconds"] = {1};
  runs_["runs"][0]["wall_seconds"] = {1};
  reference::write_rendering(folder_ / "ball/brighter.exr", picture(1.5, 0, 0));
  double expected = 0;
  for (int x = 0; x < kSize; ++x) {
    const double b = 0.2 + 0.6 * x / (kSize - 1);
    expected += 0.25 * b * b / (b * b + kRelMseEpsilon) / kSize;
  }
  const Difference d = load()[0].forms[0].difference;
  EXPECT_NEAR(d.rel_mse, expected, 1e-6);
  EXPECT_NEAR(d.bias, 0.5, 1e-6);
  EXPECT_EQ(d.noise, 0);
}

TEST_F(ReportTest, CostIsTheMedianOfPairs) {
  const auto scenes = load();
  EXPECT_DOUBLE_EQ(scenes[0].forms[0].cost.value(), 1);
  EXPECT_DOUBLE_EQ(scenes[0].forms[1].cost.value(), 1.5);  // 1.5, 1.5, 1.5, 9: one disturbed run has no effect
  for (json& run : runs_["runs"])
    for (json& time : run["cpu_seconds"]) time = 0.1 * time.get<double>();
  EXPECT_FALSE(load()[0].forms[1].cost.has_value()) << "chance";
  runs_["runs"].erase(0);
  EXPECT_FALSE(load()[0].forms[0].cost.has_value());
}

TEST_F(ReportTest, TakesTheWorstMaterial) {
  const FormReport exact = load()[0].forms[1];
  EXPECT_EQ(exact.closures(), 3);
  EXPECT_EQ(exact.relative_l1(), 1e-5);
  EXPECT_EQ(load()[0].forms[0].closures(), std::nullopt);
}

TEST_F(ReportTest, WritesJsonCsvAndPreviews) {
  load();
  write_report(folder_);
  std::ifstream json_file(folder_ / "report.json");
  const json report = json::parse(json_file);
  const json& scene = report["scenes"][0];
  EXPECT_EQ(scene["description"], "a <ball> & more");
  EXPECT_EQ(scene["forms"][1]["cost"], 1.5);
  EXPECT_EQ(scene["forms"][0]["closures"], json());
  std::ifstream csv_file(folder_ / "report.csv");
  EXPECT_THAT(std::string(std::istreambuf_iterator<char>(csv_file), {}), HasSubstr("\nball,exact,"));
  std::vector<std::string> names{scene["reference"]["preview"]};
  for (const json& form : scene["forms"])
    for (const json& name : form["previews"]) names.push_back(name);
  EXPECT_THAT(names, testing::IsSupersetOf({"ball/reference.png", "ball/exact.png", "ball/exact-difference.png",
                                            "ball/glossy.png", "ball/glossy-p-values.png"}));
  for (const std::string& name : names)
    EXPECT_EQ(reference::read_image(folder_ / name, reference::ColorConfig::current()).width, kSize) << name;
  for (const auto& entry : fs::recursive_directory_iterator(folder_))
    EXPECT_NE(entry.path().filename().string().front(), '.') << entry.path() << ": a temporary file was left";
}

/// What the page says stands in report.json, so that it computes nothing.
TEST_F(ReportTest, JsonSaysWhatTheMeasurementsMean) {
  runs_["runs"].push_back(runs_["runs"][1]);
  runs_["runs"].back()["form"] = "sampled";
  runs_["runs"].back()["images"] = {"dark.exr"};  // no test of a single picture
  for (const char* times : {"cpu_seconds", "wall_seconds"}) runs_["runs"].back()[times] = {4.0};
  reference::write_rendering(folder_ / "ball/dark.exr", picture(0.5, 0, 0));
  load();
  write_report(folder_);
  std::ifstream file(folder_ / "report.json");
  const json report = json::parse(file);
  EXPECT_EQ(report["format"], 2);
  EXPECT_EQ(report["equal_error_at"], json({16, 256, 1024}));
  EXPECT_EQ(report["test"]["tile"], kTestTile);
  EXPECT_EQ(report["forms"], json::parse(R"([{"form": "glossy", "label": "Blender's Glossy node", "native": true},
                                             {"form": "exact", "label": "exact", "native": false},
                                             {"form": "sampled", "label": "sampled", "native": false}])"));
  const json& scene = report["scenes"][0];
  EXPECT_EQ(scene["default_form"], "exact");
  EXPECT_EQ(scene["models"], json({"coupled", "lambert"}));
  EXPECT_EQ(scene["exposure"], 0);
  EXPECT_GT(scene["difference_scale"], 0.3);  // half of the brightest light, 0.4
  const json &glossy = scene["forms"][0], &exact = scene["forms"][1], &sampled = scene["forms"][2];
  EXPECT_EQ(glossy["label"], "Blender's Glossy node");
  for (const char* key : {"native", "biased", "differs", "pareto"}) EXPECT_EQ(glossy[key], true) << key;
  for (const char* key : {"native", "biased", "differs"}) EXPECT_EQ(exact[key], false) << key;
  EXPECT_EQ(exact["pareto"], true);
  EXPECT_EQ(exact["test"]["rejected_tiles"], 0);
  EXPECT_EQ(exact["previews"]["equal_time"], "ball/exact-equal-time.png");
  EXPECT_EQ(exact["equal_time"]["images"], 3);
  EXPECT_EQ(sampled["differs"], true);
  EXPECT_EQ(sampled["pareto"], false) << "exact takes less time, and has a smaller error";
  EXPECT_EQ(sampled["test"], json());
  EXPECT_EQ(sampled["previews"]["p_values"], json());
  const json& verdict = report["verdict"];
  EXPECT_EQ(verdict["judged"], 1);
  EXPECT_EQ(verdict["same"], 1);
  EXPECT_EQ(verdict["costs"], 1);
  EXPECT_EQ(verdict["cost"], json({{"median", 1.5}, {"least", 1.5}, {"most", 1.5}}));
  EXPECT_EQ(verdict["worst_bias"]["form"], "sampled");
  EXPECT_EQ(verdict["worst_bias"]["scene"], "ball");
  EXPECT_NEAR(verdict["worst_bias"]["bias"], -0.5, 1e-3);
}

TEST(Statistics, MedianOfAnEvenCountIsBetweenTheMiddleTwo) {
  EXPECT_EQ(median({3, 1, 2}), 2);
  EXPECT_EQ(median({4, 1, 2, 8}), 3);
}

TEST_F(ReportTest, PreviewsShowThePicturesAndTheSignOfTheDifference) {
  load();
  write_report(folder_);
  const Image shown = reference::read_image(folder_ / "ball/reference.png", reference::ColorConfig::current());
  EXPECT_NEAR(shown.pixel(kSize / 2, 3)[0], reference().mean.pixel(kSize / 2, 3)[0], 0.01);
  const Image difference =
      reference::read_image(folder_ / "ball/glossy-difference.png", reference::ColorConfig::current());
  double red = 0, blue = 0;
  for (int y = 0; y < kSize; ++y) {
    red += difference.pixel(kSize - 1, y)[0];
    blue += difference.pixel(kSize - 1, y)[2];
  }
  EXPECT_GT(red, blue + 0.1 * kSize);  // 10 % too bright at the bright end
}

TEST_F(ReportTest, ErrorsNameFileAndKey) {
  EXPECT_EQ(load_error(), "no error");
  const json good = runs_;
  const auto with = [&](const char* pointer, json value) {
    runs_ = good;
    runs_[json::json_pointer(pointer)] = std::move(value);
    return load_error();
  };
  EXPECT_THAT(with("/format", 2), HasSubstr("ball/runs.json: format"));
  EXPECT_THAT(with("/scene", "other"), HasSubstr("runs.json: scene"));
  EXPECT_THAT(with("/reference/spp", "many"), HasSubstr("reference.spp"));
  EXPECT_THAT(with("/runs/0/images/1", "absent.exr"), HasSubstr("runs[0].images[1]"));
  EXPECT_THAT(with("/runs/0/form", "exact"), HasSubstr("runs[1].form"));
  EXPECT_THAT(with("/runs/0/form", "../up"), HasSubstr("runs[0].form"));
  EXPECT_THAT(with("/runs/1/cpu_seconds", {1, 2}), HasSubstr("runs[1].cpu_seconds: expected 4 numbers"));
  EXPECT_THAT(with("/runs/1/materials/0/closures", -1), HasSubstr("runs[1].materials[0].closures"));
  EXPECT_THAT(with("/settings/width", 32), HasSubstr("reference.image"));
  EXPECT_THAT(with("/runs", json::array()), HasSubstr("runs: expected at least one form"));
  runs_ = good;
  runs_["runs"][1].erase("wall_seconds");
  EXPECT_THAT(load_error(), HasSubstr("wall_seconds"));

  runs_ = good;
  Rendering broken = picture(1, 0, 0);
  broken.mean.pixel(5, 7)[1] = std::nanf("");
  reference::write_rendering(folder_ / "ball/exact-0.exr", broken);
  EXPECT_THAT(load_error(), HasSubstr("(5, 7)"));
}

TEST_F(ReportTest, ASceneThatWasNotRenderedIsLeftOutAndNamed) {
  EXPECT_EQ(load().size(), 1u);
  EXPECT_TRUE(not_rendered(folder_).empty());
  fs::create_directories(folder_ / "unfinished");
  std::ofstream(folder_ / "unfinished/scene.json") << "{}";
  EXPECT_EQ(load().size(), 1u);
  EXPECT_EQ(not_rendered(folder_), std::vector{folder_ / "unfinished"});
  fs::remove_all(folder_ / "ball");
  EXPECT_THROW(load_report(folder_), InputError);
  EXPECT_THROW(load_report(folder_ / "nowhere"), InputError);
}

TEST(Statistics, RefusesWhatDoesNotFit) {
  const std::vector<Rendering> none;
  EXPECT_THROW(mean_of(none), std::invalid_argument);
  const std::vector<Rendering> different{picture(1, 0, 0), Rendering{Image(2, 2), {}, {}}};
  EXPECT_THROW(mean_of(different), std::invalid_argument);
  Rendering black = reference();
  black.mean = Image(kSize, kSize);
  EXPECT_THROW(measure_difference(picture(1, 0, 0), black, "a", "b"), InputError);
}

std::vector<Rendering> noisy(double factor, int count, unsigned seed) {
  std::vector<Rendering> out;
  for (int i = 0; i < count; ++i) out.push_back(picture(factor, kNoise, seed + unsigned(i)));
  return out;
}

/// A picture with grey noise, which is stated in its variance layer.
Rendering noisy_reference(unsigned seed = 99) {
  Rendering out = reference();
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0, kNoise / 4);
  for (std::size_t i = 0; i < out.mean.rgb.size(); i += 3) {
    const float noise = normal(random);
    for (std::size_t c = 0; c < 3; ++c) out.mean.rgb[i + c] += noise;
  }
  std::fill(out.variance->rgb.begin(), out.variance->rgb.end(), float(sqr(kNoise / 4)));
  out.metadata = {{"samples", 1024}};
  return out;
}

TEST(Welch, AcceptsPicturesThatDifferInNoiseAlone) {
  const WelchTest t = welch_test(noisy(1, 8, 1), noisy_reference(), "a", "b");
  EXPECT_TRUE(t.passed());
  EXPECT_EQ(t.pixels, kSize * kSize);
  EXPECT_EQ(t.tiles, sqr(kSize / kTestTile));
  EXPECT_GT(t.uniform, 0.01);
  EXPECT_GE(t.accepted(), kTestAccepted);
}

/// By chance the spread of four pictures is small in one tile of many. In 400 trials at 0.01, 13 rejections or more
/// happen once in 10,000 times.
TEST(Welch, RejectsFewPicturesOfPureNoiseNoMoreThanItSays) {
  int rejected = 0;
  for (unsigned trial = 1; trial <= 400; ++trial)
    rejected += !welch_test(noisy(1, 4, 10 * trial), noisy_reference(10 * trial + 5), "a", "b").passed();
  EXPECT_LT(rejected, 13);
}

TEST(Welch, PValuesAreUniformWhereTheReferenceHasNoNoise) {
  EXPECT_GT(welch_test(noisy(1, 8, 1), reference(), "a", "b").uniform, 0.01);
}

TEST(Welch, RejectsABiasThatNoiseHides) {
  // A seventh of the noise of a pixel's mean: no pixel shows it, but every tile does.
  const std::vector<Rendering> pictures = noisy(1.01, 8, 1);
  const WelchTest t = welch_test(pictures, reference(), "a", "b");
  EXPECT_FALSE(t.passed());
  EXPECT_GT(t.rejected_tiles, 0);
  EXPECT_LT(t.uniform, 0.01);
}

TEST(Welch, RejectsAFewWrongPixels) {
  std::vector<Rendering> pictures = noisy(1, 8, 1);
  for (Rendering& r : pictures)
    for (int x = 0; x < kSize / 4; ++x)
      for (int c = 0; c < 3; ++c) r.mean.pixel(x, 5)[c] += 1;
  const WelchTest t = welch_test(pictures, reference(), "a", "b");
  EXPECT_FALSE(t.passed());
  EXPECT_GE(t.rejected_pixels, kSize / 4);
  EXPECT_LT(t.p.pixel(3, 5)[0], 1e-6);
}

/// Light that reaches one pixel in a hundred: the others are darker than the mean by more than rounding, and agree.
TEST(Welch, RareLightIsNoise) {
  constexpr double kChance = 0.01, kDot = 0.2;
  std::vector<Rendering> pictures(4, picture(1, 0, 0));
  std::mt19937 random(7);
  std::bernoulli_distribution rare(kChance);
  for (Rendering& r : pictures)
    for (std::size_t i = 0; i < r.mean.rgb.size(); i += 3) {
      const float light = rare(random) ? float(kDot) : 0;
      for (std::size_t c = 0; c < 3; ++c) r.mean.rgb[i + c] += light;
    }
  Rendering expected = reference();
  for (float& v : expected.mean.rgb) v += float(kChance * kDot);
  EXPECT_TRUE(welch_test(pictures, expected, "a", "b").passed());
  // Without it, nothing remains that could be noise.
  pictures.assign(4, picture(1, 0, 0));
  EXPECT_EQ(welch_test(pictures, expected, "a", "b").rejected_pixels, kSize * kSize);
}

TEST(Welch, WithoutNoiseOnlyRoundingIsForgiven) {
  std::vector<Rendering> pictures(2, picture(1, 0, 0));
  EXPECT_EQ(welch_test(pictures, reference(), "a", "b").worst_pixel, 1);
  pictures.assign(2, picture(1 + 1e-6, 0, 0));
  EXPECT_TRUE(welch_test(pictures, reference(), "a", "b").passed());
  pictures.assign(2, picture(1 + 1e-3, 0, 0));
  EXPECT_EQ(welch_test(pictures, reference(), "a", "b").rejected_pixels, kSize * kSize);
}

/// Next to a lobe, Blender's picture of scenes/gl-fig11.json always has 1e-33 where the reference has 0.
TEST(Welch, WhatNobodySeesIsNoDifference) {
  Rendering dark = reference();
  std::vector<Rendering> pictures(2, picture(1, 0, 0));
  const auto corner = [&](Rendering& r, float value) {
    for (int y = 0; y < kTestTile; ++y)
      for (int x = 0; x < kTestTile; ++x)
        for (int c = 0; c < 3; ++c) r.mean.pixel(x, y)[c] = value;
  };
  corner(dark, 0);
  for (Rendering& r : pictures) corner(r, 1e-33F);
  EXPECT_TRUE(welch_test(pictures, dark, "a", "b").passed());
  for (Rendering& r : pictures) corner(r, 1e-9F);
  EXPECT_EQ(welch_test(pictures, dark, "a", "b").rejected_tiles, 1);
}

TEST(Welch, RefusesWhatItCannotJudge) {
  EXPECT_THROW(welch_test(noisy(1, 1, 1), reference(), "a", "b"), std::invalid_argument);
  EXPECT_THROW(welch_test(noisy(1, 2, 1), picture(1, 0, 0), "a", "b"), std::invalid_argument);
}

TEST_F(ReportTest, EqualErrorCountsTheSamplesThatAFormNeeds) {
  // Noise decreases as 1/n for both forms; "exact" starts with twice the noise and costs the same per sample.
  runs_["convergence"] = json::array();
  for (const int spp : {16, 256, 1024})
    for (const char* form : {"glossy", "exact"}) {
      const bool native = std::string(form) == "glossy";
      json images = json::array();
      for (unsigned i = 0; i < 4; ++i) {
        const std::string name = fmt::format("{}-{}-{}.exr", form, spp, i);
        const float noise = kNoise * float(std::sqrt((native ? 1. : 2.) * 16 / spp));
        reference::write_rendering(folder_ / "ball" / name,
                                   picture(1, noise, 1000 + unsigned(spp) * 10 + i + (native ? 0 : 5)));
        images.push_back(name);
      }
      runs_["convergence"].push_back(
          {{"form", form}, {"spp", spp}, {"images", images}, {"cpu_seconds", json::array({spp, spp, spp, spp})}});
    }
  const auto scenes = load();
  const FormReport &glossy = scenes[0].forms[0], &exact = scenes[0].forms[1];
  ASSERT_EQ(exact.equal_error.size(), 3u);
  for (const auto& cost : glossy.equal_error) EXPECT_NEAR(cost.value(), 1, 1e-9);
  for (const auto& cost : exact.equal_error) EXPECT_NEAR(cost.value(), 2, 0.1);
  EXPECT_EQ(exact.cost, 1) << "of the longest renders, not the short ones";
  // A rare bright path can keep the measured noise from decreasing: that must not be extrapolated.
  for (json& point : runs_["convergence"])
    if (point["form"] == "exact" && point["spp"] == 1024)
      for (json& image : point["images"]) image = "exact-256-" + image.get<std::string>().substr(11);
  EXPECT_NEAR(load()[0].forms[1].equal_error[2].value(), 8, 0.4);
  runs_["convergence"][0]["form"] = "fitted";
  EXPECT_THAT(load_error(), HasSubstr("convergence[0].form"));
}

TEST_F(ReportTest, EqualTimeTakesTheImagesThatFit) {
  // The exact form costs 1.5 times as much: in the same time it gets 4 / 1.5 = 2.7 images, whose mean has 4 / 3 of the
  // noise of all four.
  const auto scenes = load();
  const FormReport &glossy = scenes[0].forms[0], &exact = scenes[0].forms[1];
  EXPECT_EQ(glossy.equal_time_images, 4);
  EXPECT_EQ(exact.equal_time_images, 3);
  EXPECT_NEAR(exact.equal_time.rel_mse / exact.difference.rel_mse, 4. / 3, 0.1);
}

TEST_F(ReportTest, ReadsFlipBesideTheRuns) {
  std::ofstream(folder_ / "ball/flip.json") << R"({"exact": 0.25})";
  const auto scenes = load();
  EXPECT_EQ(scenes[0].forms[1].flip, 0.25);
  EXPECT_EQ(scenes[0].forms[0].flip, std::nullopt);
  std::ofstream(folder_ / "ball/flip.json") << R"({"exact": 2})";
  EXPECT_THAT(load_error(), HasSubstr("flip.json: exact: expected"));
}

}  // namespace
}  // namespace brdfc::report
