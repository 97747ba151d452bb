// SPDX-License-Identifier: GPL-3.0-or-later
// Compares the path tracer that traces many paths together with the plain one, path by path.
#include "plain_path_tracer.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <filesystem>

#include "reference/path_tracer.h"
#include "support.h"

namespace brdfc::reference {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 24, kSamples = 4;

struct Difference {
  double light = 0, off = 0;  // sums over paths: the light, and the difference for paths that agree
  int paths = 0, apart = 0;   // `apart`: paths that continue differently because rounding decided a choice or a hit
};

Difference compare(const Scene& scene, const RenderSettings& settings) {
  RenderOptions options;
  options.settings = settings;
  const PathTracer many(scene, options);
  const PlainPathTracer plain(scene, settings);
  std::vector<PathTracer::Start> starts;
  for (int y = 0; y < settings.height; ++y)
    for (int x = 0; x < settings.width; ++x)
      for (int s = 0; s < settings.spp; ++s) starts.push_back({x, y, s});
  std::vector<Rgb<double>> light(starts.size()), expected(starts.size());
  PathTracer::Wave wave = many.make_wave();
  many.follow(starts, wave, light);
  tbb::parallel_for(std::size_t(0), starts.size(),
                    [&](std::size_t i) { expected[i] = plain.follow(starts[i].x, starts[i].y, starts[i].sample); });
  Difference d;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const double sum = luminance(expected[i]);
    const double off = std::max({std::abs(light[i].r - expected[i].r), std::abs(light[i].g - expected[i].g),
                                 std::abs(light[i].b - expected[i].b)});
    ++d.paths;
    d.light += sum;
    if (off > 1e-4 * max_component(expected[i]) + 1e-12) {
      ++d.apart;
    } else {
      d.off += off;
    }
  }
  return d;
}

class PlainPath : public testing::TestWithParam<std::string> {};

TEST_P(PlainPath, CarriesTheSameLight) {
  const Scene scene = load_scene(fs::path(BRDFC_SOURCE_DIR) / "scenes" / (GetParam() + ".json"));
  RenderSettings settings = scene.settings;
  settings.height = std::max(1, kWidth * settings.height / settings.width);
  settings.width = kWidth;
  settings.spp = kSamples;
  for (const Strategy strategy : {Strategy::Mis, Strategy::Brdf, Strategy::Light}) {
    settings.strategy = strategy;
    const Difference d = compare(scene, settings);
    fmt::print("{} {}: {} paths, {} apart, the others {:.2g} of the light\n", GetParam(),
               strategy_names()[std::size_t(strategy)], d.paths, d.apart, d.off / d.light);
    EXPECT_GT(d.light, 0);
    EXPECT_LE(d.off, 1e-9 * d.light);
    EXPECT_LE(d.apart, d.paths / 500);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, PlainPath,
                         testing::ValuesIn(third_of(std::vector<std::string>{
                             "all-models", "as-fig8", "dispersion", "gl-fig11", "gl-fig13-hammersley", "lamps",
                             "long-models", "ra-refract", "room-coupled", "sh-glass", "sh-models"})),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace brdfc::reference
