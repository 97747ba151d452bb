// SPDX-License-Identifier: GPL-3.0-or-later
// Rays hit the same points if objects share meshes; and the memory that meshes take.
#include "reference/tracer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <memory>
#include <new>

#include "reference/random.h"
#include "reference/shapes.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;

constexpr Vector kOne{1, 1, 1};
constexpr std::size_t kCopyAll = std::numeric_limits<std::size_t>::max();

/// Rotated about all axes, then moved.
Transform transform(const Vector& scale, double turn, const Vector& to) {
  const double c = std::cos(turn), s = std::sin(turn), d = std::cos(2 * turn), t = std::sin(2 * turn);
  const std::array<std::array<double, 3>, 3> r{{{c * d, -s, c * t}, {s * d, c, s * t}, {-t, 0, d}}};
  Transform out;
  for (int i = 0; i < 3; ++i) out.matrix[i] = {r[i][0] * scale.x, r[i][1] * scale.y, r[i][2] * scale.z};
  out.translation = to;
  return out;
}

/// Objects with a common mesh, each at its own place.
Scene scene_of(Mesh mesh, const std::vector<Transform>& places) {
  Scene scene;
  const auto shared = std::make_shared<const Mesh>(std::move(mesh));
  for (const Transform& place : places) {
    Object object;
    object.mesh = shared;
    object.transform = place;
    object.material = int(scene.objects.size());
    scene.objects.push_back(object);
  }
  return scene;
}

std::vector<Transform> row(int count) {
  std::vector<Transform> places;
  for (int i = 0; i < count; ++i) places.push_back(transform(kOne, 0.1 * i, {2.5 * i, 0, 0}));
  return places;
}

Vector direction(Random& random) {
  const double z = 2 * random.uniform() - 1, phi = 2 * kPi * random.uniform(), r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

TEST(Tracer, StoresEqualMeshesOnce) {
  const Mesh mesh = make_sphere(1, 64, 32, true);
  const std::size_t one = Tracer(scene_of(mesh, row(1))).memory(), few = Tracer(scene_of(mesh, row(20))).memory();
  EXPECT_GT(few, 15 * one) << "copies are quicker, and these are small";
  const std::size_t places = 1000;
  EXPECT_LT(places * mesh.triangles.size() / 2, kMostCopies) << "the next lines have to ask for sharing";
  EXPECT_LT(Tracer(scene_of(mesh, row(int(places))), 0).memory(), 5 * one);
  // Shared without being requested, as a large number of copies would need too much memory.
  const Mesh fine = make_sphere(1, 512, 256, true);
  EXPECT_LT(Tracer(scene_of(fine, row(12))).memory(), 2 * Tracer(scene_of(fine, row(1))).memory());
}

TEST(Tracer, SaysThatMemoryIsOut) {
  const Scene scene = scene_of(make_sphere(1, 256, 128, true), row(2));
  EXPECT_THROW(Tracer(scene, kMostCopies, std::size_t(1) << 20), std::bad_alloc);
  EXPECT_NO_THROW(Tracer(scene, kMostCopies, std::size_t(1) << 28));
}

TEST(Tracer, SharedMeshesAreMetWhereCopiesAre) {
  Scene scene = scene_of(make_knot(2, 3, 0.2, 8, 512, 32),
                         {transform(kOne, 0.3, {0, 0, 0}), transform({1, 0.2, 3}, 1.1, {3, -1, 2}),
                          transform(kOne * 0.01, 2.2, {1.9, 0.1, 0.4}), transform({40, 40, 0.5}, 0, {0, 0, -9})});
  scene.objects[3].camera_only = true;
  const Tracer copied(scene, kCopyAll), shared(scene, 0);
  const auto bounds = copied.bounds(), same = shared.bounds();
  EXPECT_NEAR(same.radius, bounds.radius, 1e-4 * bounds.radius);
  EXPECT_GE(same.radius, bounds.radius * (1 - 1e-6));
  std::vector<Ray> rays;
  Random random(1, 2, 3);
  for (int i = 0; i < 20000; ++i) {
    const Vector from = direction(random) * 8.0, to = direction(random) * (2 * random.uniform());
    rays.push_back({from, normalize(to - from), i % 3 ? kInfinity : 8.0});
  }
  for (const bool from_camera : {false, true}) {
    std::vector<Meeting> a(rays.size()), b(rays.size());
    copied.intersect(rays, from_camera, a);
    shared.intersect(rays, from_camera, b);
    std::vector<std::uint8_t> hidden_a(rays.size()), hidden_b(rays.size());
    copied.occluded(rays, hidden_a);
    shared.occluded(rays, hidden_b);
    int met = 0, differ = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      // A single ray finds the same as a packet.
      Meeting alone;
      shared.intersect({&rays[i], 1}, from_camera, {&alone, 1});
      ASSERT_EQ(alone.part, b[i].part);
      if (shared.material(alone) >= 0) {
        ASSERT_EQ(std::tie(alone.triangle, alone.u, alone.v), std::tie(b[i].triangle, b[i].u, b[i].v));
      }
      ASSERT_EQ(shared.occluded(rays[i]), bool(hidden_b[i]));
      Hit x, y;
      const bool hit_x = copied.intersect(rays[i], from_camera, x), hit_y = shared.intersect(rays[i], from_camera, y);
      met += hit_x;
      // At outlines and edges rounding decides.
      if (hit_x != hit_y || hidden_a[i] != hidden_b[i] || a[i].part != b[i].part || length(x.p - y.p) > 1e-4) {
        ++differ;
        continue;
      }
      if (!hit_x) continue;
      EXPECT_EQ(x.material, y.material);
      EXPECT_EQ(x.inside, y.inside);
      EXPECT_LT(length(x.normal - y.normal), 1e-3);
      if (a[i].triangle == b[i].triangle) {
        EXPECT_EQ(x.geometric.x, y.geometric.x);
        EXPECT_NEAR(x.u, y.u, 1e-4);
        EXPECT_NEAR(x.v, y.v, 1e-4);
      }
    }
    EXPECT_GT(met, int(rays.size() / 8));
    EXPECT_LE(differ, int(rays.size() / 2000));
  }
}

// Rounding errors must be smaller than the offset of rays from a surface, whatever its position and size.
TEST(Tracer, RaysLeaveASharedMesh) {
  for (const Vector& place : {Vector{0, 0, 0}, Vector{1000, -1000, 1000}, Vector{1e5, 3, -2e4}}) {
    const double size = std::max(0.1, maximum(abs(place.x), abs(place.z)) * 1e-3);
    Scene scene = scene_of(make_sphere(1, 64, 32, true), {transform({size, 1.7 * size, 0.4 * size}, 0.7, place),
                                                          transform(kOne * size, 0.2, place + kOne * (9 * size))});
    const Tracer shared(scene, 0);
    Random random(4, 5, 6);
    int met = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vector from = place + direction(random) * (3 * size);
      Hit hit;
      if (!shared.intersect({from, normalize(place + direction(random) * (0.9 * size) - from)}, false, hit)) continue;
      if (hit.material != 0) continue;
      ++met;
      const Vector out = direction(random);
      const bool outwards = dot(out, hit.geometric) > 0;
      // From a convex body, an outward ray hits nothing and an inward ray the other side.
      Hit next;
      const bool found = shared.intersect({Tracer::leave(hit.p, hit.geometric, out), out}, false, next);
      if (outwards)
        EXPECT_TRUE(!found || next.material == 1) << i;
      else
        EXPECT_TRUE(found && (next.inside || std::abs(dot(out, hit.geometric)) < 1e-2)) << i;
    }
    EXPECT_GT(met, 5000);
  }
}

}  // namespace
}  // namespace brdfc::reference
