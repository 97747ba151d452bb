// SPDX-License-Identifier: GPL-3.0-or-later
// The view angles at which a scene is seen, compared with points on its triangles; and forms that are cut to them.
#include "reference/views.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fit/fit.h"
#include "forms/form.h"
#include "measure/fold.h"
#include "measure/stored_albedo.h"
#include "model/horizon.h"
#include "plan/plan.h"
#include "reference/shapes.h"

namespace brdfc::reference {
namespace {

using testing::HasSubstr;
using testing::Not;
using Vector = Vec3<double>;

Camera camera(const Vector& position, const Vector& target, bool orthographic, double half_height) {
  Camera c;
  c.orthographic = orthographic;
  c.position = position;
  c.forward = normalize(target - position);
  c.right = normalize(cross(c.forward, Vector{0.1, 0.2, 1}));
  c.up = cross(c.right, c.forward);
  c.half_height = half_height;
  return c;
}

Object placed(Mesh mesh, const Vector& at = {0, 0, 0}, int material = 0) {
  Object o;
  o.mesh = std::make_shared<const Mesh>(std::move(mesh));
  o.transform.translation = at;
  o.material = material;
  return o;
}

Scene scene(const Camera& camera, std::vector<Object> objects, int max_bounces = 0,
            const std::string& model = "lambert") {
  Scene s;
  s.camera = camera;
  s.settings.max_bounces = max_bounces;
  int materials = 0;
  for (const Object& o : objects) materials = std::max(materials, o.material + 1);
  s.materials.resize(std::size_t(materials));
  for (Material& m : s.materials) m.model = &find_model(model);
  s.objects = std::move(objects);
  return s;
}

/// View cosines of points on a mesh in the picture, ignoring occlusion.
Cosines at_points(const Scene& s, const Mesh& mesh, std::mt19937_64& rng) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto to_vector = [](const std::array<float, 3>& a) { return Vector{a[0], a[1], a[2]}; };
  const Camera& c = s.camera;
  Cosines out{1, 0};
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 20000; ++i) {
      double u = uniform(rng), v = uniform(rng);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const auto at = [&](const auto& values) {
        return to_vector(values[std::size_t(t[0])]) * (1 - u - v) + to_vector(values[std::size_t(t[1])]) * u +
               to_vector(values[std::size_t(t[2])]) * v;
      };
      const Vector p = at(mesh.vertices), ahead = p - c.position;
      const double depth = dot(ahead, c.forward), scale = c.orthographic ? 1 : depth;
      const double half_width = c.half_height * s.settings.width / s.settings.height;
      if (depth < 0 || std::abs(dot(ahead, c.right)) > half_width * scale ||
          std::abs(dot(ahead, c.up)) > c.half_height * scale)
        continue;
      const Vector wo = c.orthographic ? -c.forward : normalize(-ahead);
      const Vector a = to_vector(mesh.vertices[std::size_t(t[0])]), b = to_vector(mesh.vertices[std::size_t(t[1])]),
                   d = to_vector(mesh.vertices[std::size_t(t[2])]);
      const Vector area = cross(b - a, d - a);
      const Vector normal = normalize(mesh.normals.empty() ? area : at(mesh.normals));
      const double cosine = std::max(dot(normal, wo) * (dot(area, wo) > 0 ? 1 : -1), kMinCosTheta);
      out.add({cosine, cosine});
    }
  return out;
}

TEST(Views, HoldEveryPointAndLittleMore) {
  std::mt19937_64 rng(7);
  std::uniform_real_distribution<float> uniform(-1, 1);
  int narrow = 0;
  for (int i = 0; i < 60; ++i) {
    Mesh mesh;
    for (int k = 0; k < 6; ++k) mesh.vertices.push_back({2 * uniform(rng), 2 * uniform(rng), uniform(rng)});
    mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
    if (i % 3 == 1)
      for (int k = 0; k < 6; ++k) {
        const Vector n = normalize(Vector{uniform(rng), uniform(rng), 1.5});
        mesh.normals.push_back({float(n.x), float(n.y), float(n.z)});
      }
    const bool orthographic = i % 2 == 1;
    Scene s = scene(camera({3 * uniform(rng), 3 * uniform(rng), 2 + uniform(rng)}, {0.3 * uniform(rng), 0, 0},
                           orthographic, orthographic ? 1.5 : 0.5),
                    {placed(mesh)});
    s.settings.width = 320;
    const Cosines bound = seen_cosines(s)[0], points = at_points(s, mesh, rng);
    if (points.low > points.high) continue;
    EXPECT_TRUE(bound.has(points)) << i << ": " << bound.low << ".." << bound.high << " and " << points.low << ".."
                                   << points.high;
    EXPECT_GT(bound.low, points.low - 0.05) << i;
    EXPECT_LT(bound.high, points.high + 0.05) << i;
    narrow += bound.high - bound.low < 0.5;
  }
  EXPECT_GT(narrow, 10);
}

TEST(Views, AreAllWhereScatteredRaysCanComeBack) {
  const Camera above = camera({1, 2, 3}, {0, 0, 0}, true, 2);
  const Object floor = placed(make_quad(2, 2)), box = placed(make_box({1, 1, 1}));
  const double cosine = 3 / std::sqrt(14);
  for (const int bounces : {0, 4}) {
    const Cosines seen = seen_cosines(scene(above, {floor}, bounces))[0];
    EXPECT_NEAR(seen.low, cosine, 1e-3);
    EXPECT_NEAR(seen.high, cosine, 1e-3);
    const Cosines of_box = seen_cosines(scene(above, {box}, bounces))[0];
    EXPECT_NEAR(of_box.low, 1 / std::sqrt(14), 1e-3);
    EXPECT_NEAR(of_box.high, cosine, 1e-3);
  }
  const auto all = [](const Scene& s) { return seen_cosines(s)[0].all(); };
  EXPECT_TRUE(all(scene(above, {floor}, 0, "glass"))) << "Cycles lets rays pass that it does not count";
  EXPECT_TRUE(all(scene(above, {box, placed(make_quad(4, 4), {0, 0, -0.5})}, 1)));
  EXPECT_TRUE(all(scene(above, {box, placed(make_box({1, 1, 1}), {3, 0, 0})}, 1)));
  EXPECT_TRUE(all(scene(camera({0, 0, 0}, {1, 0, 0}, false, 1), {box}, 1))) << "from inside";
  EXPECT_TRUE(all(scene(camera({1, 2, -3}, {9, 9, -9}, false, 0.1), {floor}, 0))) << "out of sight";

  // Two sides of a roof: rays from inside hit the other side.
  Mesh roof;
  roof.vertices = {{-1, 0, 0}, {0, -1, 1}, {0, 1, 1}, {1, 0, 0}};
  roof.triangles = {{0, 1, 2}, {3, 2, 1}};
  EXPECT_FALSE(all(scene(camera({0, 0, 5}, {0, 0, 0}, false, 1), {placed(roof)}, 1)));
  EXPECT_TRUE(all(scene(camera({0, 0, -5}, {0, 0, 0}, false, 1), {placed(roof)}, 1)));
  // A box without a lid shows its inner sides.
  Mesh open = make_box({1, 1, 1});
  std::erase_if(open.triangles, [&](const auto& t) {
    return std::ranges::all_of(t, [&](int v) { return open.vertices[std::size_t(v)][2] > 0; });
  });
  ASSERT_EQ(open.triangles.size(), 10u);
  EXPECT_TRUE(all(scene(above, {placed(open)}, 1)));
}

TEST(Views, AreThoseOfEachMaterial) {
  const auto seen = seen_cosines(scene(camera({0, 0, 5}, {0, 0, 0}, false, 0.9),
                                       {placed(make_quad(1, 1)), placed(make_quad(1, 1), {3, 0, 0}, 1)}, 2));
  EXPECT_GT(seen[0].low, 0.98);
  EXPECT_NEAR(seen[0].high, 1, 1e-4);
  EXPECT_NEAR(seen[1].low, 5 / std::hypot(5, 3.5, 0.5), 1e-3);
  EXPECT_NEAR(seen[1].high, 5 / std::hypot(5, 2.5), 1e-3);
}

constexpr Cosines kSome{0.35, 0.9};

TEST(Views, CutAlbedoTablesHoldTheSameNumbers) {
  const Model& m = find_model("coupled");
  const measure::AlbedoTable whole = measure::albedo_table_of(m);
  for (const ParamValues& fixed : {ParamValues{}, ParamValues{{"r0", 0.137}}}) {
    ParamValues values = complete(m.info(), {{"r0", 0.137}});
    const measure::AlbedoTable all = measure::fold(whole, m, fixed), cut = measure::fold(whole, m, fixed, kSome);
    EXPECT_LT(cut.size(), all.size());
    for (const double c : {0.35, 0.5, 0.7123, 0.9}) {
      const Rgb<double> want = lookup(all, m, values, c), got = lookup(cut, m, values, c);
      EXPECT_NEAR(got.r, want.r, 1e-7) << c;
      EXPECT_NEAR(got.b, want.b, 1e-7) << c;
    }
  }
  EXPECT_EQ(measure::fold(whole, m, {}, {0, 1}).size(), whole.size());
}

TEST(Views, CutFitsHoldTheSameNumbers) {
  for (const bool axis : {false, true}) {
    const Model& m = find_model("phong");
    ParamValues known = complete(m.info(), {{"e", 20.0}});
    if (axis) known.erase("e");
    const ParamValues values = fit::roles_of(m, known).fitted();
    const fit::Fit& whole = fit::fit_of(m, values);
    const fit::Varied<double> varied(20);
    // Also for ranges between two knots, and ranges that end at the last knot.
    for (const Cosines& views : {kSome, Cosines{0.5, 0.501}, Cosines{0, 0.1}, Cosines{0.99, 1}}) {
      const fit::Fit cut = fit::fit_of(m, values, views);
      EXPECT_LT(cut.size(), whole.size());
      EXPECT_FALSE(cut.errors().empty());
      for (const double c : {views.low, 0.3 * views.low + 0.7 * views.high, views.high}) {
        const Vector wo = {std::sqrt(1 - c * c), 0, std::max(c, kMinCosTheta)};
        const auto want = whole.closures(wo, varied), got = cut.closures(wo, varied);
        ASSERT_EQ(got.size(), want.size());
        for (std::size_t i = 0; i < want.size(); ++i) {
          EXPECT_NEAR(got[i].weight.r, want[i].weight.r, 1e-9) << c;
          EXPECT_NEAR(got[i].exponent, want[i].exponent, 1e-9 * want[i].exponent);
          EXPECT_NEAR(got[i].normal.x, want[i].normal.x, 1e-9);
          EXPECT_NEAR(got[i].normal.z, want[i].normal.z, 1e-9);
          for (std::size_t k = 0; k < kRampSize; ++k)
            EXPECT_NEAR(got[i].ramp[k].r, want[i].ramp[k].r, 1e-9 * (1 + std::abs(want[i].ramp[k].r)));
        }
      }
    }
    // The error is largest at grazing views.
    const double of_all = whole.mean_l1(20.0);
    EXPECT_LT(fit::fit_of(m, values, {0.7, 1}).mean_l1(20.0), of_all);
    EXPECT_GT(fit::fit_of(m, values, {0, 0.1}).mean_l1(20.0), of_all);
    EXPECT_EQ(fit::fit_of(m, values, {}).size(), whole.size());
  }
}

TEST(Views, OfAllMaterialsOfAModelArePlannedFor) {
  const Model& m = find_model("phong");
  const ParamValues values = complete(m.info(), {{"e", 20.0}});
  const auto need = [&](const char* id, const Cosines& views) {
    plan::MaterialNeed need{id, &m, values, {}};
    need.views = views;
    return need;
  };
  const plan::PlannedModel plan = plan::plan_scene({need("a", {0.4, 0.6}), need("b", {0.5, 0.97})})[0];
  EXPECT_EQ(plan.views.low, 0.4);
  EXPECT_EQ(plan.views.high, 0.97);
  EXPECT_THAT(plan.reasons, testing::Contains("view angles below 14 and beyond 67 degrees: never seen"));
  EXPECT_THAT(plan::plan_scene({need("a", {0.4, 1})})[0].reasons,
              testing::Contains("view angles beyond 67 degrees: never seen"));
  const plan::PlannedModel all = plan::plan_scene({need("a", {0.4, 0.6}), need("b", {})})[0];
  EXPECT_THAT(all.reasons, testing::Each(Not(HasSubstr("never seen"))));
  // Errors at views that do not occur do not count.
  plan::Budget budget;
  budget.error = 0.006;
  EXPECT_EQ(plan::plan_scene({need("a", {})}, budget)[0].forms[0], forms::form("aimed"));
  EXPECT_EQ(plan::plan_scene({need("a", {0.7, 0.9})}, budget)[0].forms[0], forms::form("fitted"));

  const measure::AlbedoTable table = measure::fold(measure::albedo_table_of(m), m, values, kSome);
  for (const forms::Form* kind : {forms::form("fitted"), forms::form("aimed")}) {
    const forms::Shader whole = kind->write(m, table, {values, {}, 0, forms::AimedBase::Fitted}),
                        cut = kind->write(m, table, {values, kSome, 0, forms::AimedBase::Fitted});
    EXPECT_LT(cut.source.size(), whole.source.size());
    EXPECT_EQ(cut.operations, whole.operations);
  }
}

}  // namespace
}  // namespace brdfc::reference
