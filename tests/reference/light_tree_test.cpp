// SPDX-License-Identifier: GPL-3.0-or-later
// Choosing one of many lamps, and hitting them, compared with examining all lamps one by one.
#include "reference/light_tree.h"

#include <gmock/gmock.h>

#include <cmath>
#include <ctime>
#include <memory>
#include <set>

#include "reference/cone.h"
#include "reference/lights.h"
#include "reference/procedural.h"
#include "reference/random.h"
#include "reference/render.h"
#include "reference/shapes.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;

/// Use the tree for any number of lamps, or never.
constexpr std::size_t kAlways = 0, kNever = std::numeric_limits<std::size_t>::max();

Vector any_direction(Random& random) { return sample_cone({0, 0, 1}, 2, random.uniform(), random.uniform()); }

/// Lamps of all kinds in a box of this half size about the origin: points, spheres, flat ones, thin ones, suns, some at
/// the same position; with powers over three decades. `least`: added to all sizes, in units of the half size.
std::vector<Light> lamps_of_all_kinds(int count, double half, std::uint64_t seed, double least = 0) {
  Random random(seed, 0, 0);
  std::vector<Light> lamps;
  for (int i = 0; i < count; ++i) {
    Light l;
    const int kind = int(random.uniform() * 20);
    const double power = std::pow(10.0, 3 * random.uniform());
    l.position = Vector{2 * random.uniform() - 1, 2 * random.uniform() - 1, 2 * random.uniform() - 1} * half;
    if (kind == 3 && !lamps.empty()) l.position = lamps.back().position;
    l.direction = any_direction(random);
    if (kind < 9) {
      l.kind = Light::Kind::Point;
      l.radius = kind < 4 ? 0 : half * (least + 0.2 * random.uniform() * random.uniform());
      l.intensity = Rgb<double>(power, 0.5 * power, power * random.uniform());
      if (l.radius > 0) l.radiance = l.intensity / (kPi * sqr(l.radius));
    } else if (kind < 11) {
      l.kind = Light::Kind::Sun;
      l.radius = kind == 9 ? 0 : std::sin(least + 0.3 * random.uniform());
      l.intensity = Rgb<double>(0.02 * power / sqr(half));
      if (l.radius > 0) l.radiance = l.intensity / (kPi * sqr(l.radius));
    } else {
      l.kind = kind < 16 ? Light::Kind::Rectangle : Light::Kind::Disk;
      Vector u, v;
      basis(l.direction, u, v);
      l.u = u * (half * (least + 0.1 * random.uniform()));
      l.v = v * (half * (least + (kind == 11 ? 0.5 : 0.1) * random.uniform()));
      l.radiance = Rgb<double>(power / (4 * length(l.u) * length(l.v)));
    }
    l.camera_visible = kind % 2 == 0;
    lamps.push_back(l);
  }
  return lamps;
}

Scene scene_with(std::vector<Light> lamps) {
  Scene s;
  s.lights = std::move(lamps);
  return s;
}

/// Points on surfaces among lamps in a box of that half size, at its edge and far away.
template <class Use> void for_places(double half, int count, const Use& use) {
  Random random(7, 7, 7);
  for (int i = 0; i < count; ++i) {
    const double away = half * std::array{0.3, 1.3, 20.0}[std::size_t(i % 3)];
    use(any_direction(random) * away, any_direction(random));
  }
}

/// A block with a single point to be shaded.
struct Place {
  const Lights& lights;
  Vectors p, normal;
  std::vector<double> memory;
  Lanes<double*> kept;
  Lanes<bool> lit;
  Place(const Lights& l, const Vector& at, const Vector& n) : lights(l), memory(kBlock * l.kept()) {
    for (std::size_t k = 0; k < kBlock; ++k) {
      p.set(k, at);
      normal.set(k, n);
      kept[k] = &memory[k * lights.kept()];
    }
    lights.chances(p, normal, kBlock, kept, lit);
  }
  double chance(std::size_t light) const { return lights.chance(light, kept[0]); }
};

// Numbers in [0, 1) are divided into intervals, one for each lamp, whose lengths are the probabilities.
TEST(LightTree, ChancesAreThoseWithWhichLampsAreChosen) {
  for (const int count : {1, 2, 9, 300}) {
    Random random(3, std::uint64_t(count), 0);
    std::vector<LampBounds> lamps;
    for (int i = 0; i < count; ++i) {
      LampBounds b;
      b.far = i % 10 == 9;
      b.centre = b.far ? any_direction(random) : any_direction(random) * (5 * random.uniform());
      b.radius = i % 3 ? 0.5 * random.uniform() * random.uniform() : 0;
      b.direction = any_direction(random);
      b.cos_cone = i % 2 ? 1 : -1;
      b.power = std::pow(10.0, 3 * random.uniform()) * (b.far ? 0.1 : 1);
      lamps.push_back(b);
    }
    const LightTree tree(lamps);
    int lit = 0;
    for_places(5, 30, [&](const Vector& p, const Vector& n) {
      double root[LightTree::kWidth];
      if (!(tree.weigh_root(p, n, root) > 0)) return;
      ++lit;
      std::vector<int> chosen(lamps.size());
      const int numbers = 1 << 15;
      double none = 0;
      for (int i = 0; i < numbers; ++i) {
        const LightTree::Choice choice = tree.choose(p, n, root, (i + 0.5) / numbers);
        if (choice.chance > 0) {
          ++chosen[choice.lamp];
          ASSERT_NEAR(choice.chance, tree.chance(choice.lamp, p, n, root), 1e-14 * choice.chance);
        } else {
          none += 1.0 / numbers;
        }
      }
      double sum = 0;
      for (std::size_t i = 0; i < lamps.size(); ++i) {
        const double chance = tree.chance(i, p, n, root);
        EXPECT_NEAR(chosen[i], chance * numbers, 1 + 1e-6) << i << " of " << count;
        sum += chance;
      }
      // The remainder belongs to bounds that are wider than their contents.
      EXPECT_NEAR(sum + none, 1, double(count + 1) / numbers);
    });
    EXPECT_GT(lit, 0);
  }
}

TEST(LightTree, LeavesOutNoLampThatContributes) {
  const Scene s = scene_with(lamps_of_all_kinds(500, 5, 2));
  const Lights tree(s, false, kAlways), list(s, false, kNever);
  double likeness = 0;
  int places = 0;
  for_places(5, 90, [&](const Vector& p, const Vector& n) {
    const Place here(tree, p, n), there(list, p, n);
    EXPECT_EQ(here.lit[0], there.lit[0]);
    for (std::size_t i = 0; i < s.lights.size(); ++i) {
      // The list treats a disk as its bounding rectangle, whose corners may be above the horizon.
      const Light& l = s.lights[i];
      const bool below = l.kind == Light::Kind::Disk && dot(l.position - p, n) < -std::max(length(l.u), length(l.v));
      EXPECT_TRUE(here.chance(i) > 0 || there.chance(i) == 0 || below) << i << " of kind " << int(l.kind);
      likeness += std::min(here.chance(i), there.chance(i));
    }
    ++places;
  });
  // The probabilities are similar, though not all lamps are examined.
  EXPECT_GT(likeness / places, 0.5);
}

TEST(LightTree, RaysMeetTheSameLamps) {
  const Scene s = scene_with(lamps_of_all_kinds(500, 5, 3));
  const Lights tree(s, false, kAlways), list(s, false, kNever);
  Random random(5, 5, 5);
  int met = 0;
  for (int block = 0; block < 200; ++block) {
    Rays rays;
    Numbers distance;
    for (std::size_t k = 0; k < kBlock; ++k) {
      const Vector from = any_direction(random) * (k % 5 ? 8.0 : 3000.0),
                   to = any_direction(random) * (6 * random.uniform());
      rays.origin.set(k, from);
      rays.direction.set(k, normalize(to - from));
      distance[k] = k % 2 ? kInfinity : length(to - from);
    }
    const auto meet = [&](const Lights& lights, bool from_camera) {
      std::multiset<std::pair<std::size_t, double>> out;
      lights.meet(rays, distance, kBlock, {}, {}, from_camera, [&](std::size_t k, const Rgb<double>& radiance, double) {
        out.emplace(k, radiance.r + 3 * radiance.b);
      });
      return out;
    };
    for (const bool from_camera : {false, true}) {
      const auto a = meet(tree, from_camera), b = meet(list, from_camera);
      EXPECT_EQ(a, b);
      met += int(a.size());
    }
  }
  EXPECT_GT(met, 5000);
}

// The pdf of a direction is the same whether it was sampled towards a lamp or hit the lamp by BSDF sampling.
TEST(LightTree, DensitiesOfDrawnAndMetDirectionsAreEqual) {
  Scene s = scene_with(lamps_of_all_kinds(300, 5, 4));
  s.environment.image = std::make_shared<const Image>(procedural_environment("interior", 64));
  const Lights lights(s, false, kAlways);
  Random random(6, 6, 6);
  int same = 0, other = 0;
  for_places(5, 90, [&](const Vector& p, const Vector& n) {
    const Place here(lights, p, n);
    LightNumbers u;
    for (std::size_t k = 0; k < kBlock; ++k) {
      u.choice[k] = random.uniform(), u.u1[k] = random.uniform();
      u.u2[k] = random.uniform(), u.u3[k] = random.uniform();
    }
    LightSamples out;
    lights.sample(here.p, here.normal, kBlock, here.kept, here.lit, u, out);
    Rays rays;
    Numbers distance;
    Lanes<const double*> kept;
    for (std::size_t k = 0; k < kBlock; ++k) {
      const bool any = out.pdf[k] > 0 && !out.delta[k];
      rays.origin.set(k, p);
      rays.direction.set(k, any ? out.wi[k] : n);
      distance[k] = any ? out.distance[k] * (1 + 1e-9) : 0;
      kept[k] = here.kept[k];
    }
    Numbers nearest;
    nearest.fill(-1);
    lights.meet(rays, distance, kBlock, here.normal, kept, false,
                [&](std::size_t k, const Rgb<double>& radiance, double pdf) {
                  // Other lamps may be in the way.
                  if (abs(radiance.r - out.radiance.r[k]) <= 1e-3 * radiance.r &&
                      abs(pdf - out.pdf[k]) < abs(nearest[k] - out.pdf[k]))
                    nearest[k] = pdf;
                });
    for (std::size_t k = 0; k < kBlock; ++k)
      if (out.pdf[k] > 0 && !out.delta[k]) (abs(nearest[k] / out.pdf[k] - 1) < 1e-6 ? same : other) += 1;
  });
  EXPECT_GT(same, 1000);
  EXPECT_LE(other, same / 200);  // at a lamp's rim, rounding decides whether a ray hits it
}

Material material(const char* model, ParamValues values) {
  Material m;
  m.id = model;
  m.model = &find_model(model);
  m.values = complete(m.model->info(), values);
  return m;
}

/// A floor, a ball and a wall, diffuse and glossy, seen orthographically from above.
Scene room(std::vector<Light> lamps) {
  Scene s = scene_with(std::move(lamps));
  s.camera.orthographic = true;
  s.camera.position = {0, 0, 50};
  s.camera.forward = {0, 0, -1};
  s.camera.right = {1, 0, 0};
  s.camera.up = {0, 1, 0};
  s.camera.half_height = 4;
  const std::array<double, 3> grey{0.6, 0.6, 0.6};
  s.materials = {material("lambert", {{"rho", grey}}), material("blinn", {})};
  const auto add = [&](Mesh mesh, const Vector& at, int material) {
    Object o;
    o.mesh = std::make_shared<const Mesh>(std::move(mesh));
    o.transform.translation = at;
    o.material = material;
    s.objects.push_back(o);
  };
  add(make_quad(20, 20), {0, 0, -2}, 0);
  add(make_sphere(1.2, 64, 32, true), {1.5, 0, -0.8}, 1);
  add(make_box({1, 4, 2}), {-2, 0, -1}, 0);
  return s;
}

Rendering picture(const Scene& s, std::size_t most_weighed, Strategy strategy, int spp, int seed, int size = 16) {
  RenderOptions o;
  o.settings = {.width = size, .height = size, .spp = spp, .seed = seed, .max_bounces = 2};
  o.settings.strategy = strategy;
  o.most_weighed = most_weighed;
  return render(s, o).rendering;
}

// Blocks of 4 x 4 pixels, three channels, three pairs of pictures: 144 comparisons. With correct code, one exceeds 4.5
// standard errors with a probability of 7e-6, and any of them with 1e-3; seeds are fixed.
TEST(LightTree, PicturesAgreeWithThoseWhereEachLampIsWeighed) {
  Scene s = room(lamps_of_all_kinds(60, 3, 5, 0.1));
  // Away from surfaces, where the light of a point lamp is unbounded.
  for (Light& l : s.lights) l.position.z = 3 + 0.5 * l.position.z;
  s.environment.image = std::make_shared<const Image>(procedural_environment("interior", 64));
  const Rendering list = picture(s, kNever, Strategy::Mis, 2000, 1);
  const Rendering pictures[] = {picture(s, kAlways, Strategy::Mis, 2000, 2),
                                picture(s, kAlways, Strategy::Light, 4000, 3),
                                picture(s, kAlways, Strategy::Brdf, 4000, 4)};
  for (const Rendering& tree : pictures)
    for (int y = 0; y < 16; y += 4)
      for (int x = 0; x < 16; x += 4)
        for (int c = 0; c < 3; ++c) {
          double difference = 0, variance = 0, sum = 0;
          for (int i = 0; i < 16; ++i) {
            const int px = x + i % 4, py = y + i / 4;
            sum += list.mean.pixel(px, py)[c];
            difference += tree.mean.pixel(px, py)[c] - list.mean.pixel(px, py)[c];
            variance += tree.variance->pixel(px, py)[c] + list.variance->pixel(px, py)[c];
          }
          EXPECT_LT(std::abs(difference), 4.5 * std::sqrt(variance)) << x << " " << y << " " << c;
          EXPECT_LT(std::sqrt(variance), 0.05 * sum) << "no power: picture " << &tree - pictures;
        }
}

TEST(LightTree, PictureDoesNotDependOnHowManyPathsAreFollowedTogether) {
  Scene s = room(lamps_of_all_kinds(60, 3, 6));
  RenderOptions o;
  o.settings = {.width = 24, .height = 24, .spp = 4, .seed = 1, .max_bounces = 4};
  const Rendering together = render(s, o).rendering;
  for (const int wave : {1, 7}) {
    o.wave = wave;
    EXPECT_EQ(render(s, o).rendering.mean.rgb, together.mean.rgb) << wave;
  }
}

double mean_of_variance(const Rendering& r) {
  double sum = 0;
  for (const float v : r.variance->rgb) sum += v;
  return sum;
}

// At equal noise, that is, seconds times variance. One lamp has other noise than many; so the noise of many is compared
// with that of weighting every lamp.
TEST(LightTree, AThousandLampsCostAtMostThreeTimesOne) {
  std::vector<Light> lamps;
  Random random(8, 8, 8);
  for (int i = 0; i < 1000; ++i) {
    Light l;
    l.position = {16 * random.uniform() - 8, 16 * random.uniform() - 8, 2 + 2 * random.uniform()};
    l.radius = 0.05;
    l.intensity = Rgb<double>(0.2 + random.uniform());
    l.radiance = l.intensity / (kPi * sqr(l.radius));
    lamps.push_back(l);
  }
  const Scene many = room(lamps), one = room({lamps.begin(), lamps.begin() + 1});
  const auto seconds = [](const auto& work) {
    const std::clock_t begin = std::clock();
    work();
    return double(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  Rendering tree;
  double of_tree = kInfinity, of_one = kInfinity;
  for (int run = 0; run < 3; ++run) {
    of_tree = std::min(of_tree, seconds([&] { tree = picture(many, kMostWeighed, Strategy::Mis, 16, 1, 64); }));
    of_one = std::min(of_one, seconds([&] { picture(one, kMostWeighed, Strategy::Mis, 16, 1, 64); }));
  }
  const double noise = mean_of_variance(tree) / mean_of_variance(picture(many, kNever, Strategy::Mis, 16, 1, 64));
  RecordProperty("time_ratio", std::to_string(of_tree / of_one));
  RecordProperty("noise_ratio", std::to_string(noise));
  EXPECT_LT(of_tree / of_one * noise, 3) << of_tree / of_one << " times the time, " << noise << " times the variance";
}

}  // namespace
}  // namespace brdfc::reference
