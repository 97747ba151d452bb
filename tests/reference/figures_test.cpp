// SPDX-License-Identifier: GPL-3.0-or-later
// What the papers state about their pictures, as numbers measured in ours: scenes/*.json by the reference renderer, in
// a smaller size, with fixed seeds. Each bound is several times the noise of the measurement.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <functional>

#include "reference/render.h"

namespace brdfc::reference {
namespace {

Scene scene(const char* name) {
  return load_scene(std::filesystem::path(BRDFC_SOURCE_DIR) / "scenes" / (std::string(name) + ".json"));
}

/// The scene's picture, `width` pixels wide.
Image picture(const Scene& s, int width, int spp) {
  RenderOptions options;
  options.settings = s.settings;
  options.settings.height = s.settings.height * width / s.settings.width;
  options.settings.width = width;
  options.settings.spp = spp;
  return render(s, options).rendering.mean;
}

using Point2 = std::array<double, 2>;

/// A pixel's centre relative to the picture's, in units of the picture's height, x to the right and y upwards.
Point2 place(const Image& image, int x, int y) {
  return {(x + 0.5 - image.width / 2.0) / image.height, (image.height / 2.0 - y - 0.5) / image.height};
}

/// Mean luminance of the selected pixels.
double mean(const Image& image, const std::function<bool(const Point2&)>& wanted) {
  double sum = 0;
  int count = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if (!wanted(place(image, x, y))) continue;
      sum += luminance(image.color(x, y));
      ++count;
    }
  EXPECT_GT(count, 0);
  return sum / count;
}

/// Selects pixels between two distances from `centre`, in units of `radius`.
std::function<bool(const Point2&)> ring(const Point2& centre, double radius, double from, double to) {
  return [=](const Point2& p) {
    const double r = hypot(p[0] - centre[0], p[1] - centre[1]) / radius;
    return r >= from && r < to;
  };
}

/// Figure 25.5 of Suffern's book, "only half as bright at the silhouette as it is in the center",
/// and 25.7, where it is even.
TEST(Figures, LostRaysDarkenTheRimOfASphereAndTurnedRaysDoNot) {
  // The sphere of radius 1 is in a picture 2.4 high. At 0.98 of its radius theta is 78.5 degrees, and (1 + cos theta) /
  // 2 of a cosine lobe about the mirror direction is above the surface.
  const Point2 middle{0, 0};
  const auto at_rim = ring(middle, 1 / 2.4, 0.97, 0.99), inside = ring(middle, 1 / 2.4, 0, 0.2);
  const Image lost = picture(scene("gl-fig5"), 192, 64);
  EXPECT_NEAR(mean(lost, at_rim) / mean(lost, inside), (1 + sqrt(1 - 0.98 * 0.98)) / 2, 0.02);
  const Image even = picture(scene("gl-fig7"), 192, 64);
  EXPECT_NEAR(mean(even, at_rim) / mean(even, inside), 1, 0.005);
  EXPECT_NEAR(mean(even, inside) / mean(even, ring(middle, 1 / 2.4, 1.05, 1.15)), 0.8, 0.003);
}

/// Figure 25.13 of Suffern's book: one sample per pixel. The single Hammersley point is the centre of the lobe,
/// whatever its width, so a diffuse sphere looks like a mirror; a regular point deflects all pixels in the same way;
/// random points cause noise.
TEST(Figures, OneSampleAPixelMakesAMirrorOfAMatteSphere) {
  const auto roughness = [](const Image& image) {  // mean difference of neighbours on the sphere
    double sum = 0;
    int count = 0;
    const auto on_sphere = ring({0, 0}, 1 / 2.4, 0, 0.8);
    for (int y = 0; y < image.height; ++y)
      for (int x = 1; x < image.width; ++x)
        if (on_sphere(place(image, x, y))) {
          sum += std::abs(luminance(image.color(x, y)) - luminance(image.color(x - 1, y)));
          ++count;
        }
    return sum / count;
  };
  Scene s = scene("gl-fig13-hammersley");
  const Image matte = picture(s, 128, 1);
  s.materials[0].values["e"] = 1e5;
  EXPECT_THAT(picture(s, 128, 1).rgb, testing::Pointwise(testing::FloatNear(1e-4f), matte.rgb));
  const double random = roughness(picture(scene("gl-fig13-random"), 128, 1));
  EXPECT_GT(random, 3 * roughness(matte));
  EXPECT_GT(random, 3 * roughness(picture(scene("gl-fig13-regular"), 128, 1)));
}

/// Radziszewski and Alda: a lossless model is invisible in a uniform world.
TEST(Figures, ALosslessSphereVanishes) {
  const Image image = picture(scene("ra-vanish"), 96, 64);
  const auto all = [](const Point2&) { return true; };
  EXPECT_NEAR(mean(image, all), 0.5, 1e-4);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) ASSERT_NEAR(image.pixel(x, y)[1], 0.5, 0.02) << x << ' ' << y;
}

/// Ashikhmin and Shirley, figure 2: "for the center of the darkest sphere ... the luminance is about 68%", by
/// quadrature 0.6957; "as the exponents get larger, less energy is lost".
TEST(Figures, AFurnaceShowsWhatAshikhminShirleyLoses) {
  const Image image = picture(scene("as-fig2"), 192, 64);
  double last = 0;
  for (int i = 0; i < 4; ++i) {
    // From the lower left, where both exponents are 10, to the upper right. The spheres' distance is 2.2 in a height of
    // 8.8.
    const double at = (i - 1.5) * 2.2 / 8.8;
    const double here = mean(image, ring({at, at}, 1 / 8.8, 0, 0.15));
    EXPECT_GT(here, last - 0.005) << i;
    last = here;
    if (i == 0) {
      EXPECT_NEAR(here, 0.6957, 0.01);
    }
  }
  EXPECT_NEAR(last, 1, 0.01);
}

/// Suffern, figure 25.8 (f): e = 100000 is "visually identical" to a mirror.
TEST(Figures, TheLargestExponentIsAMirror) {
  Scene glossy = scene("gl-fig8");
  Scene mirror = glossy;
  const Model& model = find_model("lambertian_specular");
  for (Material& m : mirror.materials) {
    m.model = &model;
    m.values = complete(model.info(), {{"rd", std::array<double, 3>{0, 0, 0}}, {"rs", 0.9}});
  }
  const Image a = picture(glossy, 180, 64), b = picture(mirror, 180, 64);
  // Only red and green: the reflection's colour is (1, 1, 0.3), the mirror's is grey. The spheres' distance is 2.2 in a
  // height of 4.4; e = 1 is at the upper left, e = 100000 at the lower right.
  const auto difference = [&](double x, double y) {
    double sum = 0, squares = 0;
    const auto wanted = ring({x / 4.4, y / 4.4}, 1 / 4.4, 0, 0.9);
    for (int j = 0; j < a.height; ++j)
      for (int i = 0; i < a.width; ++i)
        if (wanted(place(a, i, j))) {
          const float *p = a.pixel(i, j), *q = b.pixel(i, j);
          sum += (p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]);
          squares += q[0] * q[0] + q[1] * q[1];
        }
    return sqrt(sum / squares);
  };
  EXPECT_LT(difference(2.2, -1.1), 0.1);
  EXPECT_GT(difference(-2.2, 1.1), 0.5) << "e = 1 is no mirror: the measure tells them apart";
}

/// Suffern, figure 25.9: reflections of all blocks are sharp where they touch the plane, whatever the exponent.
TEST(Figures, ReflectionsAreSharpAtContact) {
  Scene sharp = scene("gl-fig9"), blurred = sharp;
  for (Scene* s : {&sharp, &blurred})
    for (Material& m : s->materials)
      if (m.model->info().name == "phong_material") m.values["e"] = s == &sharp ? 1e5 : 100.;
  const Image a = picture(sharp, 320, 32), b = picture(blurred, 320, 32);
  // The blocks are in rows 25 to 112 of 160; the plane's reflection ends at row 65. Means over 4 x 4 pixels.
  const auto difference = [&](int from, int to) {
    double sum = 0, total = 0;
    for (int y = from; y + 4 <= to; y += 4)
      for (int x = 240; x + 4 <= 284; x += 4) {
        double of_a = 0, of_b = 0;
        for (int j = 0; j < 4; ++j)
          for (int i = 0; i < 4; ++i) of_a += a.pixel(x + i, y + j)[0], of_b += b.pixel(x + i, y + j)[0];
        sum += std::abs(of_a - of_b), total += of_a;
      }
    return sum / total;
  };
  EXPECT_LT(difference(106, 110), 0.5 * difference(76, 96)) << difference(106, 110);
  EXPECT_GT(difference(76, 96), 0.1);
}

/// Shirley and others, figure 4: "the blurring in the specular reflection is mostly vertical".
TEST(Figures, BumpsBlurALowReflectionMostlyUpwards) {
  Scene bumpy = scene("sh-fig4-low");
  Scene level = bumpy;
  const auto flat = std::make_shared<Mesh>(*level.objects.front().mesh);
  for (auto& v : flat->vertices) v[2] = 0;
  for (auto& n : flat->normals) n = {0, 0, 1};
  level.objects.front().mesh = flat;
  struct Spread {
    double x, y;
  };
  // Square root of the second moments of the lamp's reflection below the horizon: of pixels above four times the
  // median, which is the tiles' own colour.
  const auto spread = [](const Image& image) {
    const int top = image.height * 55 / 100;
    std::vector<float> blue;
    for (int y = top; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) blue.push_back(image.pixel(x, y)[2]);
    std::nth_element(blue.begin(), blue.begin() + blue.size() / 2, blue.end());
    const double matte = blue[blue.size() / 2];
    double w = 0, x1 = 0, y1 = 0, x2 = 0, y2 = 0;
    for (int y = top; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const double v = std::max(image.pixel(x, y)[2] - 4 * matte, 0.0);
        w += v, x1 += v * x, y1 += v * y, x2 += v * x * x, y2 += v * y * y;
      }
    EXPECT_GT(w, 0);
    return Spread{sqrt(x2 / w - sqr(x1 / w)), sqrt(y2 / w - sqr(y1 / w))};
  };
  const Spread rough = spread(picture(bumpy, 240, 64)), smooth = spread(picture(level, 240, 64));
  const double across = sqr(rough.x) - sqr(smooth.x), along = sqr(rough.y) - sqr(smooth.y);
  EXPECT_GT(along, 2 * std::max(across, 0.0)) << rough.x << ' ' << rough.y << ' ' << smooth.x << ' ' << smooth.y;
}

/// Radziszewski and Alda, figure 1, in a uniform world: reciprocal Phong and microfacets lose light at the rim, their
/// model does not.
TEST(Figures, OnlyTheLosslessModelKeepsItsRim) {
  Scene row = scene("ra-fig1");
  row.lights.clear();
  row.environment.color = {1, 1, 1};
  const Image image = picture(row, 400, 32);
  // The spheres' distance is 2.2 in a height of 2.2.
  const auto rim = [&](int i) { return mean(image, ring({double(i - 2), 0}, 1 / 2.2, 0.95, 0.99)); };
  EXPECT_NEAR(rim(0), 1, 0.01) << "Lambert";
  EXPECT_NEAR(rim(4), 1, 0.01) << "Radziszewski and Alda";
  for (const int other : {1, 3}) EXPECT_LT(rim(other), 0.95) << other;
}

/// In the scene furnace, all white balls but three are visible: the other models lose light at the rim or, for
/// Schlick's double term, gain it.
TEST(Figures, RivalsFailVisiblyInAFurnace) {
  const Image image = picture(scene("furnace"), 250, 64);
  // Balls of radius 1 at a distance of 2.2 in a height of 4.4.
  const auto rim = [&](int column, int row) {
    const Point2 at{(column - 2) * 2.2 / 4.4, (row == 0 ? 1.1 : -1.1) / 4.4};
    return mean(image, ring(at, 1 / 4.4, 0.9, 0.98)) / 0.45;
  };
  for (const int kept : {0, 1, 2}) EXPECT_NEAR(rim(kept, 0), 1, 0.01) << kept;
  EXPECT_GT(rim(3, 0), 1.1) << "Schlick's double term";
  for (int lost = 0; lost < 5; ++lost) EXPECT_LT(rim(lost, 1), 0.95) << lost;
}

}  // namespace
}  // namespace brdfc::reference
