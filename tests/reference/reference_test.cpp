// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer compared with closed forms and with itself; and picture files.
//
// Statistics: seeds are fixed, so results are reproducible. Deviations are compared with their standard errors; with
// correct code a number differs by more than 4.5 standard errors with a probability of 7e-6.
#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "core/write_beside.h"
#include "reference/color.h"
#include "reference/lights.h"
#include "reference/procedural.h"
#include "reference/render.h"
#include "reference/shapes.h"

namespace brdfc::reference {
namespace reference_test {

/// Reflects like Lambert, but returns NaN for light from the left.
template <class T> struct Broken {
  T dummy{};
  static ModelInfo info() {
    return {
        .name = "broken", .label = "Broken", .paper = "", .equations = "", .doc = "", .properties = {}, .params = {}};
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(dummy, NumberSpec{"dummy", "Dummy", 0.25, 0, 1, 0, 1, "", ""});
  }
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>&) const {
    return Rgb<T>(select(wi.x < T(0), log(T(-1)), T(1) / pi<T>()));
  }
  T pdf(const Vec3<T>& wi, const Vec3<T>&) const { return wi.z / pi<T>(); }
  Sample<T> sample(const Vec3<T>&, const Vec3<T>&) const { return {{T(0), T(0), T(1)}, Rgb<T>(T(1)), T(1)}; }
};

}  // namespace reference_test

namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kSigmas = 4.5;

/// White by default.
Material material_with(const std::string& model, ParamValues values) {
  Material m;
  m.id = model;
  m.model = &find_model(model);
  m.values = complete(m.model->info(), values);
  return m;
}
ParamValue grey(double x) { return std::array<double, 3>{x, x, x}; }
Material lambert(double rho) { return material_with("lambert", {{"rho", grey(rho)}}); }

Object object(Mesh mesh, Vec3<double> at = {0, 0, 0}, int material = 0) {
  Object o;
  o.mesh = std::make_shared<const Mesh>(std::move(mesh));
  o.transform.translation = at;
  o.material = material;
  return o;
}

/// Orthographic, looking straight down on the origin, y upwards in the picture.
Camera camera_above(double height, double z = 50) {
  Camera c;
  c.orthographic = true;
  c.position = {0, 0, z};
  c.forward = {0, 0, -1};
  c.right = {1, 0, 0};
  c.up = {0, 1, 0};
  c.half_height = height / 2;
  return c;
}

/// A large horizontal plane through the origin, of which so small a spot is seen that all its points are alike.
Scene plane(Material m) {
  Scene s;
  s.camera = camera_above(1e-3);
  s.materials.push_back(std::move(m));
  s.objects.push_back(object(make_quad(100, 100)));
  return s;
}

RenderOptions options(int size, int spp, int max_bounces = 0) {
  RenderOptions o;
  o.settings = {.width = size, .height = size, .spp = spp, .seed = 7, .max_bounces = max_bounces};
  return o;
}

struct Estimate {
  double mean = 0, error = 0;
};

/// Mean over all pixels and channels, and its standard error; the channels of a path are not independent.
Estimate total(const Rendering& r) {
  Estimate e;
  const std::size_t n = r.mean.rgb.size();
  for (const float x : r.mean.rgb) e.mean += x / double(n);
  for (const float v : r.variance->rgb) e.error += 3.0 * v / (double(n) * double(n));
  e.error = std::sqrt(e.error);
  return e;
}

void expect_radiance(const Scene& scene, double expected, double precision, int spp = 4096,
                     Strategy strategy = Strategy::Mis) {
  RenderOptions o = options(4, spp);
  o.settings.strategy = strategy;
  const Estimate e = total(render(scene, o).rendering);
  EXPECT_LE(e.error, precision * expected) << "the test has no power";
  // Pixels are floats, and points are rounded to float.
  EXPECT_NEAR(e.mean, expected, kSigmas * e.error + 1e-6 * expected);
}

Light point_light(Vec3<double> at, double intensity, double radius) {
  Light l;
  l.kind = Light::Kind::Point;
  l.position = at;
  l.radius = radius;
  l.intensity = Rgb<double>(intensity);
  if (radius > 0) l.radiance = l.intensity / (kPi * radius * radius);
  return l;
}

Light sun_light(Vec3<double> direction, double irradiance, double half_angle) {
  Light l;
  l.kind = Light::Kind::Sun;
  l.direction = normalize(direction);
  l.radius = std::sin(half_angle);
  l.intensity = Rgb<double>(irradiance);
  if (half_angle > 0) l.radiance = l.intensity / (kPi * sqr(l.radius));
  return l;
}

/// Emits downwards from height h, with half axes a and b along x and y.
Light flat_light(Light::Kind kind, double h, double a, double b, double radiance) {
  Light l;
  l.kind = kind;
  l.position = {0, 0, h};
  l.direction = {0, 0, -1};
  l.u = {a, 0, 0};
  l.v = {0, b, 0};
  l.radiance = Rgb<double>(radiance);
  return l;
}

TEST(Reference, PointLightOnAPlane) {
  const Vec3<double> at{0.7, -0.4, 2};
  const double d2 = dot(at, at), expected = 5 * at.z / std::sqrt(d2) / d2 * 0.6 / kPi;
  Scene s = plane(lambert(0.6));
  s.lights = {point_light(at, 5, 0)};
  expect_radiance(s, expected, 1e-5, 16);
  // A sphere entirely above the horizon gives the same irradiance as a point.
  s.lights = {point_light(at, 5, 1.2)};
  for (const Strategy strategy : {Strategy::Mis, Strategy::Light, Strategy::Brdf})
    expect_radiance(s, expected, 0.01, 4096, strategy);
  // Inside the sphere, its radiance comes from all sides.
  s.lights = {point_light({0, 0, 0.3}, 5, 10)};
  expect_radiance(s, s.lights[0].radiance.r * 0.6, 0.01);
}

TEST(Reference, SunOnAPlane) {
  Scene s = plane(lambert(0.6));
  const double expected = 3 * (2 / std::sqrt(4 + 1 + 0.25)) * 0.6 / kPi;
  s.lights = {sun_light({1, 0.5, -2}, 3, 0)};
  expect_radiance(s, expected, 1e-6, 4);
  // The irradiance of a sun above the horizon is independent of its size.
  for (const double half_angle : {1e-3, 0.3}) {
    s.lights = {sun_light({1, 0.5, -2}, 3, half_angle)};
    expect_radiance(s, expected, 0.01);
  }
  expect_radiance(s, expected, 0.01, 8192, Strategy::Brdf);
}

TEST(Reference, AreaLightsOnAPlane) {
  const double h = 1.5, a = 1.1, b = 0.4, radiance = 4;
  Scene s = plane(lambert(0.6));
  // A disk centred above the point: E = pi L r^2 / (r^2 + h^2).
  s.lights = {flat_light(Light::Kind::Disk, h, a, a, radiance)};
  for (const Strategy strategy : {Strategy::Mis, Strategy::Light, Strategy::Brdf})
    expect_radiance(s, radiance * a * a / (a * a + h * h) * 0.6, 0.01, 4096, strategy);
  // Four rectangles with a corner above the point (configuration factor of a parallel rectangle).
  const double x = a / h, y = b / h;
  const double factor = 4 / (2 * kPi) *
                        (x / std::sqrt(1 + x * x) * std::atan(y / std::sqrt(1 + x * x)) +
                         y / std::sqrt(1 + y * y) * std::atan(x / std::sqrt(1 + y * y)));
  s.lights = {flat_light(Light::Kind::Rectangle, h, a, b, radiance)};
  for (const Strategy strategy : {Strategy::Mis, Strategy::Light, Strategy::Brdf})
    expect_radiance(s, radiance * factor * 0.6, 0.012, 4096, strategy);
  // The back of a lamp is dark.
  s.lights[0].direction = {0, 0, 1};
  EXPECT_EQ(total(render(s, options(4, 16)).rendering).mean, 0);
}

TEST(Reference, ManyLightsAddUp) {
  Scene s = plane(lambert(0.6));
  s.lights = {point_light({0, 0, 2}, 5, 0), sun_light({0, 0, -1}, 3, 0), flat_light(Light::Kind::Disk, 1, 2, 2, 4),
              point_light({0, 0, -2}, 1e6, 0.1)};
  s.environment.color = Rgb<double>(0.25);
  expect_radiance(s, 0.6 * (5 / 4.0 / kPi + 3 / kPi + 4 * 4 / 5.0 + 0.25), 0.01);
}

TEST(Reference, EnvironmentImageOnAPlane) {
  // A few bright texels among dim ones; the expected value is from fine quadrature over the upper hemisphere.
  Image image(16, 8);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = 0.1f + 0.01f * float(i % 7);
  for (int c = 0; c < 3; ++c) image.pixel(3, 1)[c] = 40, image.pixel(15, 3)[c] = 25, image.pixel(5, 6)[c] = 1000;
  Scene s = plane(lambert(0.6));
  s.environment.image = std::make_shared<const Image>(image);
  s.environment.strength = 0.5;
  double irradiance = 0;
  const int n = 1024;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < 4 * n; ++i) {
      // Uniform in z^2 is uniform in cos(theta) d omega.
      const double z = std::sqrt((j + 0.5) / n), phi = 2 * kPi * (i + 0.5) / (4 * n), r = std::sqrt(1 - z * z);
      const Rgb<double> c = s.environment.radiance({r * std::cos(phi), r * std::sin(phi), z});
      irradiance += kPi * (c.r + c.g + c.b) / 3 / (4.0 * n * n);
    }
  for (const Strategy strategy : {Strategy::Mis, Strategy::Light, Strategy::Brdf})
    expect_radiance(s, irradiance * 0.6 / kPi, 0.02, 8192, strategy);
  // The camera sees the image itself.
  s.objects[0] = object(make_quad(1, 1), {0, 0, 1000});
  s.camera.orthographic = false;
  const double u = 3.5 / 16, v = 1 - 1.5 / 8;
  s.camera.forward = equirectangular_to_direction(u, v);
  s.camera.right = normalize(cross(s.camera.forward, {0, 0, 1}));
  s.camera.up = cross(s.camera.right, s.camera.forward);
  s.camera.half_height = 1e-6;
  EXPECT_NEAR(total(render(s, options(2, 2)).rendering).mean, 20, 1e-3);
}

TEST(Reference, EnvironmentDensityIsNormalised) {
  Environment e;
  e.image = std::make_shared<const Image>(procedural_environment("sky", 64));
  const EnvironmentSampler sampler(e);
  double sum = 0;
  const int n = 512;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < 2 * n; ++i) {
      const double z = (j + 0.5) / n * 2 - 1, phi = 2 * kPi * (i + 0.5) / (2 * n), r = std::sqrt(1 - z * z);
      double u, v;
      direction_to_equirectangular({r * std::cos(phi), r * std::sin(phi), z}, u, v);
      sum += sampler.pdf(u, v) * 4 * kPi / (2.0 * n * n);
    }
  EXPECT_NEAR(sum, 1, 2e-3);
  for (int i = 0; i < 1000; ++i) {
    double found_u, found_v;
    const double t = (i + 0.5) / 1000;
    const EnvironmentSampler::Choice choice = sampler.choose(t, std::fmod(t * 37, 1), std::fmod(t * 91, 1));
    const Vec3<double> w = choice.direction();
    EXPECT_NEAR(dot(w, w), 1, 1e-12);
    direction_to_equirectangular(w, found_u, found_v);
    EXPECT_NEAR(found_u, choice.u, 1e-12);
    EXPECT_NEAR(found_v, choice.v(), 1e-8);
    EXPECT_NEAR(sampler.pdf(found_u, found_v), choice.pdf, 1e-9 * choice.pdf);
  }
}

TEST(Reference, WhiteFurnace) {
  // With Lambert of reflectance 1, every path has weight 1: no noise, also between several objects.
  Scene s;
  s.camera = camera_above(3);
  s.materials = {lambert(1)};
  s.objects = {object(make_sphere(0.6, 64, 32, false)), object(make_box({0.5, 2.5, 1}), {-1.2, 0, 0})};
  s.environment.color = Rgb<double>(1);
  const Image white = render(s, options(24, 8, 1000)).rendering.mean;
  for (const float x : white.rgb) EXPECT_FLOAT_EQ(x, 1);
  // The coupled model chooses between mirror and diffuse at random.
  s.objects = {object(make_sphere(1, 256, 128, true))};
  s.materials = {material_with("coupled", {{"r0", 0.05}, {"rm", grey(1)}})};
  const Estimate e = total(render(s, options(24, 512, 1)).rendering);
  EXPECT_LT(e.error, 1e-3);
  EXPECT_NEAR(e.mean, 1, kSigmas * e.error + 2e-4);  // smooth normals lose a little light at the rim
}

TEST(Reference, MirrorAndRestTogetherAreUnbiased) {
  const Material m = material_with("coupled", {{"r0", 0.3}, {"rm", grey(0.5)}});
  const auto brdf = m.model->make_double(m.values);
  const Vec3<double> wo{std::sin(1.0), 0, std::cos(1.0)};
  double albedo = brdf->mirror(wo).g;
  const int n = 4000;
  for (int i = 0; i < n; ++i) {  // the matte term does not depend on the azimuth
    const double z = (i + 0.5) / n;
    albedo += brdf->eval({std::sqrt(1 - z * z), 0, z}, wo).g * z * 2 * kPi / n;
  }
  Scene s = plane(m);
  s.camera.position = wo * 50.0;
  s.camera.forward = -wo;
  s.camera.right = {0, 1, 0};
  s.camera.up = cross(s.camera.right, s.camera.forward);
  s.environment.color = Rgb<double>(1);
  for (const Strategy strategy : {Strategy::Mis, Strategy::Light}) expect_radiance(s, albedo, 0.01, 8192, strategy);
}

/// Glossy spheres, a wall, and lights of every kind that a ray can hit.
Scene busy_scene() {
  Scene s;
  s.camera = camera_above(4);
  s.materials = {material_with("ashikhmin_shirley", {{"rs", grey(0.6)}, {"rd", grey(0.3)}, {"nu", 50.0}, {"nv", 10.0}}),
                 material_with("radziszewski_alda", {{"n", 2.0}}), lambert(0.5),
                 material_with("coupled", {{"r0", 0.1}, {"rm", grey(0.8)}})};
  s.objects = {object(make_sphere(0.8, 64, 32, true), {-0.9, 0.8, 0.8}, 0),
               object(make_sphere(0.8, 64, 32, true), {0.9, 0.8, 0.8}, 1), object(make_quad(8, 8), {0, 0, 0}, 2),
               object(make_box({2, 0.5, 0.6}), {0, -1.2, 0.3}, 3)};
  s.lights = {point_light({0.5, -0.5, 2.5}, 6, 0.3), sun_light({1, 1, -1}, 2, 0.1),
              flat_light(Light::Kind::Rectangle, 3, 0.8, 0.3, 3)};
  s.environment.image = std::make_shared<const Image>(procedural_environment("interior", 64));
  s.environment.strength = 0.2;
  return s;
}

TEST(Reference, StrategiesAgree) {
  const Scene s = busy_scene();
  const int size = 16;
  // BRDF sampling alone rarely hits small lamps, so it gets more samples.
  RenderOptions mis = options(size, 512, 1), light = mis, brdf = mis;
  light.settings.seed = 8;
  light.settings.spp = 1024;
  light.settings.strategy = Strategy::Light;
  brdf.settings.seed = 9;
  brdf.settings.spp = 4096;
  brdf.settings.strategy = Strategy::Brdf;
  const Rendering a = render(s, mis).rendering, b = render(s, light).rendering, c = render(s, brdf).rendering;
  EXPECT_LT(total(a).error, 0.01 * total(a).mean);
  // The whole picture, and blocks of 4 x 4 pixels, for which the central limit theorem applies.
  for (const Rendering* other : {&b, &c}) {
    const Estimate x = total(a), y = total(*other);
    EXPECT_LT(y.error, 0.02 * y.mean);
    EXPECT_NEAR(x.mean, y.mean, kSigmas * std::hypot(x.error, y.error));
    for (int by = 0; by < size; by += 4)
      for (int bx = 0; bx < size; bx += 4) {
        double difference = 0, variance = 0;
        for (int i = 0; i < 16; ++i) {
          const int px = bx + i % 4, py = by + i / 4;
          difference += a.mean.pixel(px, py)[1] - other->mean.pixel(px, py)[1];
          variance += a.variance->pixel(px, py)[1] + other->variance->pixel(px, py)[1];
        }
        EXPECT_LT(std::abs(difference), kSigmas * std::sqrt(variance)) << bx << " " << by;
      }
  }
  // MIS must be worth its cost.
  EXPECT_LT(total(a).error * std::sqrt(512), total(c).error * std::sqrt(4096));
}

TEST(Reference, PictureDoesNotDependOnThreads) {
  const Scene s = busy_scene();
  RenderOptions one = options(40, 5, 3), three = one, other = one;
  one.threads = 1;
  three.threads = 3;
  other.settings.seed = 8;
  const Rendering a = render(s, one).rendering, b = render(s, three).rendering;
  EXPECT_EQ(a.mean.rgb, b.mean.rgb);
  EXPECT_EQ(a.variance->rgb, b.variance->rgb);
  EXPECT_NE(a.mean.rgb, render(s, other).rendering.mean.rgb);
}

/// busy_scene() with bump maps, absorption, mirrors and transmission, a texture, and a wall that only the camera sees.
Scene crowded_scene() {
  Scene s = busy_scene();
  s.materials.push_back(material_with("glass", {{"density", 0.7}}));
  s.materials.push_back(material_with("radziszewski_alda", {{"n", 20.0}, {"around", "refraction"}}));
  s.materials.push_back(material_with("fresnel_conductor", {}));
  auto picture = std::make_shared<Image>(2, 2);
  picture->rgb = {0.9f, 0.1f, 0.1f, 0.1f, 0.9f, 0.1f, 0.1f, 0.1f, 0.9f, 0.8f, 0.8f, 0.8f};
  s.materials[2].textures["rho"] = picture;
  for (int i = 0; i < 3; ++i) s.objects.push_back(object(make_sphere(0.4, 32, 16, true), {-1.0 + i, -0.3, 0.5}, 4 + i));
  s.objects.push_back(object(make_box({0.5, 0.5, 1.5}), {-1.6, -0.6, 0.75}, 2));
  s.objects.back().camera_only = true;
  return s;
}

// Single paths are traced by single rays, many paths by packets: both results are equal to the last bit.
TEST(Reference, PictureDoesNotDependOnHowManyPathsAreFollowedTogether) {
  const Scene s = crowded_scene();
  for (const bool scaled : {false, true}) {
    RenderOptions o = options(40, 6, 8);
    o.settings.scale_radiance = scaled;
    o.settings.pattern = scaled ? Pattern::Jittered : Pattern::Random;
    const Rendering together = render(s, o).rendering;
    EXPECT_GT(total(together).mean, 0);
    for (const int wave : {1, 7}) {
      o.wave = wave;
      const Rendering few = render(s, o).rendering;
      EXPECT_EQ(few.mean.rgb, together.mean.rgb) << wave;
      EXPECT_EQ(few.variance->rgb, together.variance->rgb) << wave;
    }
  }
}

// Shared meshes are intersected by rays transformed to object space, also in packets.
TEST(Reference, SharedMeshesLookAsCopiesDo) {
  Scene s = crowded_scene();
  for (Object& o : s.objects)
    if (o.mesh->triangles.size() > 1000) {
      const auto& m = o.transform.matrix;
      o.mesh = s.objects[0].mesh;
      o.transform.matrix = {{{m[0][0] * 0.6, 0, 0}, {0, m[1][1] * 0.5, 0}, {0, 0, m[2][2] * 0.6}}};
    }
  RenderOptions o = options(40, 8, 6);
  const Rendering copied = render(s, o).rendering;
  o.most_copies = 0;
  const Rendering shared = render(s, o).rendering;
  EXPECT_NE(copied.mean.rgb, shared.mean.rgb) << "nothing was shared";
  // Random numbers are the same, and so are paths except for rounding, which decides at edges.
  int differ = 0;
  for (std::size_t i = 0; i < copied.mean.rgb.size(); ++i)
    differ += std::abs(copied.mean.rgb[i] - shared.mean.rgb[i]) > 1e-3 * copied.mean.rgb[i] + 1e-6;
  EXPECT_LE(differ, 0.02 * double(copied.mean.rgb.size()));
  for (const int wave : {1, 7}) {
    o.wave = wave;
    EXPECT_EQ(render(s, o).rendering.mean.rgb, shared.mean.rgb) << wave;
  }
}

TEST(Reference, VarianceLayerIsRight) {
  // The variance of many small renderings compared with the one that a single rendering states.
  const Scene s = busy_scene();
  const int runs = 40;
  std::vector<double> sum, sum2, claimed;
  for (int i = 0; i < runs; ++i) {
    RenderOptions o = options(6, 24, 1);
    o.settings.seed = 100 + i;
    const Rendering r = render(s, o).rendering;
    sum.resize(r.mean.rgb.size());
    sum2.resize(sum.size());
    claimed.resize(sum.size());
    for (std::size_t k = 0; k < sum.size(); ++k) {
      sum[k] += r.mean.rgb[k];
      sum2[k] += sqr(double(r.mean.rgb[k]));
      claimed[k] += r.variance->rgb[k] / runs;
    }
  }
  double observed = 0, expected = 0;
  for (std::size_t k = 0; k < sum.size(); ++k) {
    observed += (sum2[k] - sum[k] * sum[k] / runs) / (runs - 1);
    expected += claimed[k];
  }
  EXPECT_NEAR(observed / expected, 1, 0.2);  // 36 pixels x 40 runs with heavy tails
}

TEST(Reference, CancelKeepsWhatIsDone) {
  const Scene s = busy_scene();
  std::atomic<bool> cancel{false};
  RenderOptions o = options(16, 1000000, 1);
  o.cancel = &cancel;
  o.progress = [&](const Progress& p) {
    EXPECT_GT(p.paths_per_second, 0);
    EXPECT_GT(p.seconds_left, 0);
    if (p.samples >= 7) cancel = true;
  };
  const RenderResult r = render(s, o);
  EXPECT_TRUE(r.cancelled);
  ASSERT_GE(r.samples, 7);
  EXPECT_LT(r.samples, 1000);
  EXPECT_EQ(r.rendering.metadata["samples"], r.samples);
  // It was stopped between two passes, so it equals a rendering with that number of samples.
  const RenderResult whole = render(s, options(16, r.samples, 1));
  EXPECT_FALSE(whole.cancelled);
  EXPECT_EQ(whole.rendering.mean.rgb, r.rendering.mean.rgb);
  // Cancelled before it begins: a black picture without variance, with 0 samples.
  const RenderResult none = render(s, o);
  EXPECT_EQ(none.samples, 0);
  EXPECT_FALSE(none.rendering.variance);
}

TEST(Reference, StopsAfterTheGivenTime) {
  RenderOptions o = options(16, 10000000, 1);
  o.max_seconds = 0.3;
  const RenderResult r = render(busy_scene(), o);
  EXPECT_FALSE(r.cancelled);
  EXPECT_GE(r.samples, 1);
  EXPECT_LT(r.samples, 10000000);
  EXPECT_LT(r.seconds, 3);
}

TEST(Reference, BouncesCountScatteringsAfterTheFirst) {
  // The visible spot is in the shadow of a lid, and receives light only through the lid and other points of the floor.
  Scene s = plane(lambert(0.5));
  s.objects.push_back(object(make_quad(2, 2), {0, 0, 0.5}));
  s.camera.position = {0, 0, 0.3};
  s.lights = {sun_light({0, 0, -1}, 1, 0)};
  std::vector<double> means;
  for (int bounces = 0; bounces <= 4; ++bounces)
    means.push_back(total(render(s, options(4, 2000, bounces)).rendering).mean);
  // From the spot by the lid to the lit floor takes two further scattering events; another round trip, four.
  EXPECT_EQ(means[0], 0);
  EXPECT_EQ(means[1], 0);
  EXPECT_GT(means[2], 0);
  EXPECT_EQ(means[3], means[2]);
  EXPECT_GT(means[4], means[3]);
}

TEST(Reference, CameraOnlyObjectsDoNotShade) {
  Scene s = plane(lambert(1));
  s.camera = camera_above(4);
  s.environment.color = Rgb<double>(1);
  s.objects.push_back(object(make_sphere(0.5, 32, 16, false), {0, 0, 0.6}, 1));
  s.materials.push_back(lambert(0));
  const auto darkest = [&] {
    // Outside the sphere's outline.
    const Image image = render(s, options(16, 16, 0)).rendering.mean;
    float least = 1;
    for (int y = 0; y < 16; ++y)
      for (int x = 0; x < 16; ++x)
        if (std::hypot(x - 7.5, y - 7.5) > 3.2) least = std::min(least, image.pixel(x, y)[0]);
    return std::pair(least, image.pixel(8, 8)[0]);
  };
  EXPECT_LT(darkest().first, 0.95f);
  s.objects[1].camera_only = true;
  EXPECT_EQ(darkest().first, 1.0f);
  EXPECT_EQ(darkest().second, 0.0f);
}

TEST(Reference, TexturesAreUprightAndLinear) {
  const Rgb<double> a(0.9, 0.2, 0.1), b(0.1, 0.3, 0.8);
  Scene s;
  s.camera = camera_above(2);
  s.materials = {lambert(0.5)};
  Image image(2, 2);
  for (int c = 0; c < 3; ++c) image.pixel(0, 0)[c] = 0.8f, image.pixel(1, 0)[c] = 0.2f, image.pixel(1, 1)[c] = 0.6f;
  s.materials[0].textures["rho"] = std::make_shared<const Image>(image);
  s.objects = {object(make_quad(2, 2))};
  s.environment.color = Rgb<double>(1);
  // Pixel centres of 4 x 4 are at a quarter and three quarters between texel centres.
  const Image out = render(s, options(4, 2000)).rendering.mean;
  const auto at = [&](double u, double v) { return float(bilinear(image, u, v, Wrap::Repeat, Wrap::Repeat).r); };
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) EXPECT_NEAR(out.pixel(x, y)[0], at((x + 0.5) / 4, 1 - (y + 0.5) / 4), 0.02) << x << y;
  EXPECT_FLOAT_EQ(at(0.25, 0.75), 0.8f);  // upper left texel
  EXPECT_FLOAT_EQ(at(0.75, 0.75), 0.2f);
  EXPECT_FLOAT_EQ(at(0.5, 0.75), 0.5f);
  EXPECT_FLOAT_EQ(at(0, 0.75), 0.5f);  // repeated
  EXPECT_FLOAT_EQ(at(1.75, -0.75), 0.6f);
  const Image checker = checker_texture(a, b, 2);
  EXPECT_NEAR(bilinear(checker, 0.2, 0.8, Wrap::Repeat, Wrap::Repeat).r, a.r, 1e-6);
  EXPECT_NEAR(bilinear(checker, 0.2, 0.2, Wrap::Repeat, Wrap::Repeat).r, b.r, 1e-6);
}

TEST(Reference, AnisotropyFollowsTheTangent) {
  // On a horizontal plane the z axis is the normal, so the tangent is the x axis: a lamp's highlight is wider in the
  // direction of the smaller exponent.
  const auto width_ratio = [](double degrees) {
    Scene s;
    s.camera = camera_above(2);
    s.materials = {material_with(
        "ashikhmin_shirley", {{"rs", grey(1)}, {"rd", grey(0)}, {"nu", 10.0}, {"nv", 1000.0}, {"part", "specular"}})};
    s.objects = {object(make_quad(4, 4))};
    const double c = std::cos(degrees * kPi / 180), n = std::sin(degrees * kPi / 180);
    s.objects[0].transform.matrix = {{{c, -n, 0}, {n, c, 0}, {0, 0, 1}}};
    s.lights = {point_light({0, 0, 1}, 1, 0)};
    const Image image = render(s, options(32, 16)).rendering.mean;
    double xx = 0, yy = 0;
    for (int y = 0; y < 32; ++y)
      for (int x = 0; x < 32; ++x) {
        xx += image.pixel(x, y)[1] * sqr(x - 15.5);
        yy += image.pixel(x, y)[1] * sqr(y - 15.5);
      }
    return xx / yy;
  };
  EXPECT_GT(width_ratio(0), 5);
  EXPECT_LT(width_ratio(90), 0.2);
}

TEST(Reference, BadValueNamesModelAndDirections) {
  const auto model = std::make_unique<detail::ModelOf<reference_test::Broken>>();
  Material m;
  m.model = model.get();
  m.values = complete(model->info(), {});
  Scene s = plane(m);
  s.lights = {point_light({1, 0, 1}, 1, 0)};
  EXPECT_NO_THROW(render(s, options(2, 2)));
  s.lights = {point_light({-1, 0, 1}, 1, 0)};
  try {
    render(s, options(2, 2));
    FAIL() << "expected a ValueError";
  } catch (const ValueError& e) {
    for (const char* part : {"broken", "dummy", "0.25", "f = (", "nan", "wi = (-0.7", "wo = ("})
      EXPECT_THAT(e.what(), HasSubstr(part));
  }
}

class ImageTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / fmt::format("brdfc_image_{}_{}", name, ::getpid());
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(ImageTest, RenderingRoundTrip) {
  Rendering r;
  r.mean = Image(5, 3);
  r.variance = Image(5, 3);
  for (std::size_t i = 0; i < r.mean.rgb.size(); ++i) {
    r.mean.rgb[i] = 1e-3f * float(i * i) + 1e5f * float(i == 7);
    r.variance->rgb[i] = 1e-9f * float(i);
  }
  r.metadata = {{"scene_hash", "0123456789abcdef"}, {"samples", 17}, {"seconds", 1.5}, {"version", BRDFC_VERSION}};
  write_rendering(folder_ / "deep" / "r.exr", r);
  const Rendering s = read_rendering(folder_ / "deep" / "r.exr");
  EXPECT_EQ(s.mean.width, 5);
  EXPECT_EQ(s.mean.rgb, r.mean.rgb);
  ASSERT_TRUE(s.variance);
  EXPECT_EQ(s.variance->rgb, r.variance->rgb);
  EXPECT_EQ(s.metadata, r.metadata);
  // No other file is left in the folder.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "deep"), fs::directory_iterator()), 1);
  r.variance.reset();
  write_rendering(folder_ / "deep" / "r.exr", r);
  EXPECT_FALSE(read_rendering(folder_ / "deep" / "r.exr").variance);
}

TEST_F(ImageTest, RenderedMetadata) {
  Scene s = plane(lambert(0.5));
  s.name = "plane";
  s.hash = "abc";
  s.environment.color = Rgb<double>(1);
  const Rendering r = render(s, options(4, 3)).rendering;
  write_rendering(folder_ / "r.exr", r);
  const nlohmann::json m = read_rendering(folder_ / "r.exr").metadata;
  EXPECT_EQ(m["scene"], "plane");
  EXPECT_EQ(m["scene_hash"], "abc");
  EXPECT_EQ(m["seed"], 7);
  EXPECT_EQ(m["samples"], 3);
  EXPECT_EQ(m["version"], BRDFC_VERSION);
  EXPECT_GT(m["seconds_tracing"].get<double>(), 0);
  EXPECT_GT(m["seconds"].get<double>(), m["seconds_tracing"].get<double>());
}

TEST_F(ImageTest, FailureLeavesTheOldFile) {
  fs::create_directories(folder_);
  std::ofstream(folder_ / "a.txt") << "old";
  EXPECT_THROW(write_beside(folder_ / "a.txt",
                            [](const fs::path& p) {
                              std::ofstream(p) << "half";
                              input_error("no space");
                            }),
               InputError);
  std::string text;
  std::ifstream(folder_ / "a.txt") >> text;
  EXPECT_EQ(text, "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
  EXPECT_THROW(write_image(folder_ / "a.txt" / "b.exr", Image(1, 1)), InputError);
  EXPECT_THROW(write_image(folder_ / "b.tif", Image(1, 1)), InputError);
  EXPECT_THROW(read_rendering(folder_ / "a.txt"), InputError);
}

TEST(Compare, KnownErrors) {
  Rendering a, b;
  a.mean = Image(2, 1);
  b.mean = Image(2, 1);
  a.mean.rgb = {1, 1, 1, 0, 0, 0.5f};
  b.mean.rgb = {1, 1, 0.5f, 0, 0, 0};
  const Comparison c = compare(a, b);
  EXPECT_DOUBLE_EQ(c.mse, (0.25 + 0.25) / 6);
  EXPECT_DOUBLE_EQ(c.rel_mse, (0.25 / 0.26 + 0.25 / 0.01) / 6);
  EXPECT_DOUBLE_EQ(c.mean_a, 3.5 / 6);
  EXPECT_DOUBLE_EQ(c.mean_b, 2.5 / 6);
  EXPECT_DOUBLE_EQ(c.bias, 1.0 / 6);
  EXPECT_DOUBLE_EQ(c.max, 0.5);
  EXPECT_EQ(c.max_x, 0);
  EXPECT_FALSE(c.noise_mse);
  b.mean = Image(1, 2);
  try {
    compare(a, b, "a.exr", "b.exr");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "a.exr has 2 x 1 pixels, b.exr has 1 x 2: expected equal sizes");
  }
  b.mean = Image(2, 1);
  b.mean.rgb[4] = std::nanf("");
  EXPECT_THROW(compare(a, b), InputError);
}

TEST(Compare, NoiseExplainsTheErrorOfTwoRenderings) {
  const Scene s = busy_scene();
  RenderOptions o = options(16, 64, 1);
  const Rendering a = render(s, o).rendering;
  o.settings.seed = 99;
  const Comparison c = compare(a, render(s, o).rendering);
  ASSERT_TRUE(c.noise_mse);
  EXPECT_NEAR(c.mse / *c.noise_mse, 1, 0.5);
}

TEST(Compare, DifferencePicture) {
  Image a(3, 1), b(3, 1);
  a.rgb = {1, 1, 1, 2, 2, 2, 0, 0, 0};
  b.rgb = {1, 1, 1, 1, 1, 1, 1, 1, 1};
  const Image d = difference_image(a, b);
  EXPECT_EQ(d.rgb, (std::vector<float>{1, 1, 1, 1, 0, 0, 0, 0, 1}));
}

TEST_F(ImageTest, PreviewIsSrgb) {
  Rendering image;
  image.mean = Image(1, 1);
  image.mean.rgb = {0.25f, 5, 0};
  write_preview(folder_ / "p.png", image, 1);
  const Image back = read_image(folder_ / "p.png", ColorConfig::current());
  EXPECT_NEAR(back.rgb[0], 0.5, 0.005);
  EXPECT_FLOAT_EQ(back.rgb[1], 1);
  EXPECT_NEAR(read_image(folder_ / "p.png", ColorConfig::current(), "linear").rgb[0], 0.735357, 0.002);
  EXPECT_THROW(write_preview(folder_ / "p.png", image, 0, "Filmic"), InputError);
  EXPECT_THROW(write_preview(folder_ / "p.jpg", image), InputError);
}

}  // namespace
}  // namespace brdfc::reference
