// SPDX-License-Identifier: GPL-3.0-or-later
// Tracing light from the lamps gives the same picture as tracing paths from the camera.
//
// Statistics: seeds are fixed. Pixels and means are compared by the standard errors of both pictures; with correct code
// a number differs by more than 5 standard errors with a probability of 6e-7.
#include "reference/light_tracer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdio>

#include "reference/shapes.h"
#include "support.h"

namespace brdfc::reference {
namespace {

constexpr double kSigmasOfLight = 5;

Rendering picture(const Scene& s, Origin origin, int width, int spp) {
  RenderOptions o;
  o.settings = s.settings;
  o.settings.height = s.settings.height * width / s.settings.width;
  o.settings.width = width;
  o.settings.spp = spp;
  o.origin = origin;
  return render(s, o).rendering;
}

struct LightEstimate {
  double mean = 0, error = 0;
};

/// Mean of the selected pixels' green channel, and its standard error. Particles reach many pixels, but no two pixels
/// share much of their noise.
template <class Wanted> LightEstimate mean(const Rendering& r, const Wanted& wanted) {
  double sum = 0, variance = 0;
  int count = 0;
  for (int y = 0; y < r.mean.height; ++y)
    for (int x = 0; x < r.mean.width; ++x) {
      if (!wanted(x, y)) continue;
      sum += r.mean.pixel(x, y)[1];
      variance += r.variance->pixel(x, y)[1];
      ++count;
    }
  EXPECT_GT(count, 0);
  return {sum / count, std::sqrt(variance) / count};
}

/// The difference in standard errors; 0 if equal, which it may be if there is no noise.
double sigmas(const LightEstimate& a, const LightEstimate& b) {
  if (a.mean == b.mean) return 0;
  return std::abs(a.mean - b.mean) / std::sqrt(a.error * a.error + b.error * b.error);
}

const auto everywhere = [](int, int) { return true; };

/// A box on a plane, diffuse and glossy, seen from the side, without lights.
Scene still_life(bool orthographic) {
  Scene s;
  s.settings = {.width = 16, .height = 16, .spp = 256, .seed = 3, .max_bounces = 2};
  s.camera.orthographic = orthographic;
  s.camera.position = {0, -6, 5};
  s.camera.forward = normalize(Vec3<double>{0, 6, -4.5});
  s.camera.right = {1, 0, 0};
  s.camera.up = cross(s.camera.right, s.camera.forward);
  s.camera.half_height = orthographic ? 2 : 0.3;
  for (const auto& [name, values] : {std::pair<std::string, std::vector<std::string>>{"lambert", {"rho=0.7"}},
                                     {"ashikhmin_shirley", {"nu=10", "nv=10"}}}) {
    Material m;
    m.id = name;
    m.model = &find_model(name);
    m.values = values_of(*m.model, values);
    s.materials.push_back(m);
  }
  const auto add = [&](Mesh mesh, Vec3<double> at, int material) {
    Object o;
    o.mesh = std::make_shared<const Mesh>(std::move(mesh));
    o.transform.translation = at;
    o.material = material;
    s.objects.push_back(o);
  };
  add(make_quad(6, 6), {0, 0, 0}, 0);
  add(make_box({1, 1, 1}), {0.2, 0.3, 0.5}, 1);
  return s;
}

Light lamp(Light::Kind kind, double size) {
  Light l;
  l.kind = kind;
  l.position = {1, -1.5, 3};
  l.direction = normalize(Vec3<double>{-0.3, 0.4, -1});
  l.u = normalize(cross(l.direction, {0, 0, 1})) * size;
  l.v = cross(l.direction, l.u);
  l.radius = size;
  l.radiance = Rgb<double>(10, 20, 5);
  l.intensity = Rgb<double>(2, 3, 4);
  return l;
}

TEST(LightTracer, EveryLampGivesThePictureOfThePathTracer) {
  struct Case {
    const char* name;
    std::optional<Light> light;
    bool sky, orthographic;
  };
  for (const Case& c : {Case{"point", lamp(Light::Kind::Point, 0), false, false},
                        {"sphere", lamp(Light::Kind::Point, 0.4), false, true},
                        {"sun", lamp(Light::Kind::Sun, 0), false, false},
                        {"wide sun", lamp(Light::Kind::Sun, 0.2), false, false},
                        {"rectangle", lamp(Light::Kind::Rectangle, 0.5), false, false},
                        {"disk", lamp(Light::Kind::Disk, 0.5), false, true},
                        {"even sky", std::nullopt, false, false},
                        {"image", std::nullopt, true, false}}) {
    Scene s = still_life(c.orthographic);
    if (c.light) {
      s.lights.push_back(*c.light);
    } else if (c.sky) {
      Image image(16, 8);
      for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = 0.1f + 0.01f * float(i % 7);
      image.pixel(3, 1)[1] = 40;
      s.environment.image = std::make_shared<const Image>(image);
      s.environment.strength = 0.5;
    } else {
      s.environment.color = Rgb<double>(0.2, 0.5, 0.8);
    }
    const Rendering path = picture(s, Origin::Camera, 16, 512), particles = picture(s, Origin::Lamps, 16, 2048);
    const LightEstimate a = mean(path, everywhere), b = mean(particles, everywhere);
    EXPECT_LT(a.error + b.error, 0.02 * a.mean) << c.name << ": the test has no power";
    EXPECT_LT(sigmas(a, b), kSigmasOfLight) << c.name << ' ' << a.mean << ' ' << b.mean;
    // Rows and columns, in which a wrong falloff or position would be visible.
    for (int i = 0; i < 16; ++i) {
      const auto row = [&](int, int y) { return y == i; };
      const auto column = [&](int x, int) { return x == i; };
      EXPECT_LT(sigmas(mean(path, row), mean(particles, row)), kSigmasOfLight) << c.name << ", row " << i;
      EXPECT_LT(sigmas(mean(path, column), mean(particles, column)), kSigmasOfLight) << c.name << ", column " << i;
    }
  }
}

/// An argument of the papers: swapping the directions changes models that are not reciprocal. Uses each ball of
/// rc-light alone, under a sun in place of the lamp, so that particles hit it.
TEST(LightTracer, SwappedDirectionsShowWhichModelsAreNotReciprocal) {
  const Scene whole = load_scene(std::filesystem::path(BRDFC_SOURCE_DIR) / "scenes" / "rc-light.json");
  int tried = 0;
  for (const Object& o : whole.objects) {
    if (o.name == "floor") continue;
    Scene s = whole;
    s.objects = {o};
    Light sun = lamp(Light::Kind::Sun, 0.1);
    sun.direction = normalize(o.transform.translation - whole.lights.at(0).position);
    s.lights = {sun};
    const Vec3<double> view = o.transform.translation - s.camera.position;
    s.camera.forward = normalize(view);
    s.camera.right = normalize(cross(s.camera.forward, {0, 0, 1}));
    s.camera.up = cross(s.camera.right, s.camera.forward);
    s.camera.half_height = 0.75 / length(view);
    s.settings.width = s.settings.height;
    // Averaged over the whole ball, both directions agree because of its symmetry: compares the rim on the light's
    // side.
    const auto lit = [](int x, int) { return x < 8; };
    const LightEstimate a = mean(picture(s, Origin::Camera, 32, 256), lit);
    const LightEstimate b = mean(picture(s, Origin::Lamps, 32, 1024), lit);
    const LightEstimate w = mean(picture(s, Origin::LampsSwapped, 32, 1024), lit);
    EXPECT_LT(a.error + b.error, 0.015 * a.mean) << o.name << ": the test has no power";
    EXPECT_LT(sigmas(a, b), kSigmasOfLight) << o.name << ' ' << a.mean << ' ' << b.mean;
    std::printf("%-20s camera %.5f  lamps %.5f  swapped %.5f\n", o.name.c_str(), a.mean, b.mean, w.mean);
    if (s.materials[std::size_t(o.material)].model->info().properties.reciprocal) {
      EXPECT_LT(sigmas(a, w), kSigmasOfLight) << o.name << ' ' << a.mean << ' ' << w.mean;
    } else {
      EXPECT_GT(sigmas(a, w), kSigmasOfLight) << o.name << ' ' << a.mean << ' ' << w.mean;
      EXPECT_GT(std::abs(w.mean / a.mean - 1), 0.05) << o.name << ' ' << a.mean << ' ' << w.mean;
    }
    ++tried;
  }
  EXPECT_EQ(tried, 6);
}

TEST(LightTracer, APictureDependsOnTheSeedAndNotOnThreads) {
  Scene s = still_life(false);
  s.lights.push_back(lamp(Light::Kind::Disk, 0.5));
  RenderOptions o;
  o.settings = s.settings;
  o.settings.spp = 4;
  o.origin = Origin::Lamps;
  o.threads = 1;
  const Image one = render(s, o).rendering.mean;
  o.threads = 3;
  EXPECT_EQ(render(s, o).rendering.mean.rgb, one.rgb);
  o.settings.seed = 4;
  EXPECT_NE(render(s, o).rendering.mean.rgb, one.rgb);
}

TEST(LightTracer, SaysWhatNoParticleCanShow) {
  const auto error = [](const Scene& s) -> std::string {
    try {
      picture(s, Origin::Lamps, 4, 1);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no InputError";
  };
  Scene s = still_life(false);
  s.objects[1].camera_only = true;
  EXPECT_THAT(error(s), testing::HasSubstr("\"camera_only\""));
  s = still_life(false);
  s.materials[0].model = &find_model("coupled");
  s.materials[0].values = values_of(*s.materials[0].model, {});
  EXPECT_THAT(error(s),
              testing::HasSubstr("material \"lambert\": coupled reflects as a mirror, expected surfaces that scatter"));
}

}  // namespace
}  // namespace brdfc::reference
