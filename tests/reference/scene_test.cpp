// SPDX-License-Identifier: GPL-3.0-or-later
// Scene files: what is accepted, what is refused with which message, and the resolved form.
#include "reference/scene.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <ctime>
#include <fstream>
#include <set>
#include <sstream>

#include "reference/json_view.h"
#include "reference/procedural.h"
#include "reference/shapes.h"
#include "support.h"

namespace brdfc::reference {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class SceneTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / fmt::format("brdfc_scene_{}_{}", name, ::getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path write(const std::string& text, const std::string& name = "s.json") const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

  static json valid() {
    return json::parse(R"({
      "name": "test",
      "settings": {"width": 8, "height": 8, "spp": 4, "seed": 3, "max_bounces": 2},
      "camera": {"type": "perspective", "position": [0, -5, 1], "look_at": [0, 0, 0], "fov_y_degrees": 40},
      "materials": {"red": {"model": "lambert", "parameters": {"rho": [0.5, 0.1, 0.1]}}},
      "objects": [{"name": "ball", "shape": {"type": "sphere", "segments": 8}, "material": "red",
                   "transform": {"translate": [1, 2, 3], "rotate_degrees": [10, 20, 30], "scale": 2}}],
      "lights": [{"type": "point", "position": [0, 0, 4], "power": 10, "radius": 0.1},
                 {"type": "sun", "direction": [0, 0, -1], "irradiance": 1, "angle_degrees": 1},
                 {"type": "area", "position": [0, 0, 4], "direction": [0, 0, -1], "size": [1, 2], "power": 10},
                 {"type": "disk", "position": [0, 0, 4], "direction": [0, 1, -1], "size": 1, "power": 10}],
      "environment": {"color": [1, 1, 1], "strength": 0.5}
    })");
  }

  /// The message of the InputError, which must be one line; "" if there is none.
  static std::string error_of(const fs::path& path) {
    try {
      load_scene(path);
    } catch (const InputError& e) {
      EXPECT_THAT(e.what(), Not(HasSubstr("\n")));
      EXPECT_THAT(e.what(), HasSubstr(path.string()));
      return e.what();
    }
    return "";
  }
  std::string error_with(const json& scene) const { return error_of(write(scene.dump())); }
  /// The error with the value at a JSON pointer replaced or added.
  std::string error_at(const std::string& pointer, const json& value) const {
    json scene = valid();
    scene[json::json_pointer(pointer)] = value;
    return error_with(scene);
  }

  fs::path folder_;
};

TEST_F(SceneTest, AcceptsAValidScene) {
  EXPECT_EQ(error_with(valid()), "");
  const Scene s = load_scene(folder_ / "s.json");
  EXPECT_EQ(s.name, "test");
  EXPECT_EQ(s.settings.max_bounces, 2);
  EXPECT_EQ(s.lights.size(), 4u);
  EXPECT_EQ(s.objects[0].mesh->triangles.size(), 8u * (2 * 4 - 2));
  EXPECT_DOUBLE_EQ(s.environment.color.g, 0.5);
}

TEST_F(SceneTest, EqualShapesAreMadeOnce) {
  const auto seconds = [&](int count) {
    json scene = valid();
    scene["objects"][0]["shape"] = {{"type", "sphere"}};
    for (int i = 1; i < count; ++i) {
      scene["objects"].push_back(scene["objects"][0]);
      scene["objects"][std::size_t(i)]["name"] = std::to_string(i);
    }
    const fs::path file = write(scene.dump());
    const std::clock_t begin = std::clock();
    const Scene s = load_scene(file);
    EXPECT_EQ(s.mesh_files.size(), 1u);
    EXPECT_EQ(s.objects.back().mesh, s.objects.front().mesh);
    EXPECT_EQ(s.resolved["objects"].back()["shape"], s.resolved["objects"][0]["shape"]);
    return double(std::clock() - begin) / CLOCKS_PER_SEC;
  };
  const double one = seconds(1);
  EXPECT_LT(seconds(200), 20 * one);
}

TEST_F(SceneTest, NamesFileKeyAndExpectation) {
  struct Case {
    const char* pointer;
    json value;
    std::vector<std::string> message;
  };
  const std::vector<Case> cases{
      // unknown keys
      {"/sky", 1, {"sky: unknown key", "environment"}},
      {"/camera/zoom", 1, {"camera.zoom: unknown key", "fov_y_degrees"}},
      {"/objects/0/shape/sides", 1, {"objects[0].shape.sides: unknown key", "rings"}},
      {"/lights/1/radius", 1, {"lights[1].radius: unknown key", "angle_degrees"}},
      // wrong types
      {"/name", 5, {"name: expected a text, found 5"}},
      {"/settings/width", "wide", {"settings.width: expected a whole number in [1, 16384], found \"wide\""}},
      {"/settings/spp", 1.5, {"settings.spp: expected a whole number"}},
      {"/objects", json::object(), {"objects: expected a list"}},
      {"/objects/0", 3, {"objects[0]: expected an object"}},
      {"/camera/position", {1, 2}, {"camera.position: expected 3 numbers"}},
      {"/camera/position/1", "y", {"camera.position[1]: expected a number"}},
      {"/objects/0/camera_only", 1, {"objects[0].camera_only: expected true or false"}},
      {"/environment", 7, {"environment: expected an object"}},
      {"/lights/0/power", nullptr, {"lights[0].power: expected a number", "found null"}},
      // out of range
      {"/camera/fov_y_degrees", 0, {"camera.fov_y_degrees: expected a number in [0.001, 175], found 0"}},
      {"/objects/0/shape/segments", 2, {"objects[0].shape.segments: expected a whole number in [3, 8192]"}},
      {"/objects/0/transform/scale", -1, {"objects[0].transform.scale: expected a number"}},
      {"/lights/0/position/2", 1e300, {"lights[0].position[2]: expected a number in [-1e+06, 1e+06]"}},
      {"/materials/red/parameters/rho", {2, 0, 0}, {"materials.red.parameters.rho[0]: expected a number in [0, 1]"}},
      {"/environment/strength", -1, {"environment.strength: expected a number in [0, 1e+09]"}},
      // contradictions
      {"/camera/look_at", {0, -5, 1}, {"camera.look_at: expected a point away from the camera"}},
      {"/camera/up", {0, 5, -1}, {"camera: expected \"up\" not to be parallel to the view"}},
      {"/lights/1/direction", {0, 0, 0}, {"lights[1].direction: expected a direction that is not zero"}},
      {"/lights/2/up", {0, 0, 2}, {"lights[2]: expected \"up\" not to be parallel"}},
      {"/objects/1", valid()["objects"][0], {"objects[1].name: \"ball\" is the name of an earlier object"}},
      // names
      {"/materials/red/model",
       "lambart",
       {"materials.red.model: did you mean lambert? expected one of", "lambert", "found \"lambart\""}},
      {"/materials/red/parameters/rhu", 1, {"materials.red.parameters.rhu: lambert has no such parameter", "rho"}},
      {"/objects/0/material", "blue", {"objects[0].material: expected one of the materials red, found \"blue\""}},
      {"/objects/0/shape/type", "cube", {"objects[0].shape.type: expected one of sphere, quad", "found \"cube\""}},
      {"/lights/0/type", "spot", {"lights[0].type: expected one of point, sun, area, disk"}},
      {"/environment", {{"procedural", "forest"}}, {"environment.procedural: expected one of sky, interior, checker"}},
      {"/materials", json::object(), {"materials: expected at least one material"}},
      // files
      {"/environment", {{"image", "none.exr"}}, {"environment.image: ", "none.exr: no such image file"}},
      {"/objects/0/shape",
       {{"type", "mesh"}, {"file", "none.obj"}},
       {"objects[0].shape.file: ", "none.obj: no such mesh file"}},
      {"/objects/0/shape",
       {{"type", "mesh"}, {"vertices", "v.npy"}, {"triangles", "t.npy"}},
       {"objects[0].shape.vertices: ", "v.npy: no such file"}},
      {"/materials/red/parameters/rho",
       {{"texture", "none.png"}},
       {"materials.red.parameters.rho.texture: ", "none.png: no such image file"}},
      {"/materials/red/parameters/rho",
       {{"texture", {{"procedural", "checker"}, {"a", {3, 0, 0}}, {"b", {0, 0, 0}}, {"cells", 2}}}},
       {"materials.red.parameters.rho: the texture has the value 3 at pixel (0, 0), expected [0, 1]"}},
  };
  for (const Case& c : cases) {
    const std::string error = error_at(c.pointer, c.value);
    for (const std::string& part : c.message) EXPECT_THAT(error, HasSubstr(part)) << c.pointer;
  }
}

TEST_F(SceneTest, NamesMissingKeys) {
  for (const char* key : {"name", "camera", "materials", "objects"}) {
    json scene = valid();
    scene.erase(key);
    EXPECT_THAT(error_with(scene), HasSubstr(fmt::format("missing key \"{}\"", key)));
  }
  json scene = valid();
  scene["lights"][0].erase("power");
  EXPECT_THAT(error_with(scene), HasSubstr("lights[0]: missing key \"power\""));
}

TEST_F(SceneTest, RefusesBrokenJson) {
  const std::string text = valid().dump();
  EXPECT_THAT(error_of(folder_ / "none.json"), HasSubstr("no such file"));
  EXPECT_THAT(error_of(folder_), HasSubstr("not a file"));
  EXPECT_THAT(error_of(write("")), HasSubstr("not valid JSON"));
  EXPECT_THAT(error_of(write(text.substr(0, 100))), AllOf(HasSubstr("not valid JSON"), HasSubstr("line 1")));
  EXPECT_THAT(error_of(write(text + "x")), HasSubstr("not valid JSON"));
  EXPECT_THAT(error_of(write("[1]")), HasSubstr("expected an object, found [1]"));
  EXPECT_THAT(error_of(write("\xff\xfe")), HasSubstr("not valid JSON"));
  // JSON has no NaN, and double no 1e999.
  EXPECT_THAT(error_of(write(R"({"name": NaN})")), HasSubstr("not valid JSON"));
  EXPECT_THAT(error_of(write(R"({"name": 1e999})")), AllOf(HasSubstr("not valid JSON"), HasSubstr("1e999")));
  EXPECT_THAT(error_of(write(R"({"name": "a", "camera": {"type": 1, "type": 2}})")),
              HasSubstr("key \"type\" is given twice"));
  EXPECT_THAT(error_of(write(R"({"na\nme": "a", "na\nme": "a"})")), HasSubstr(R"(key "na\nme" is given twice)"));
  EXPECT_THAT(error_of(write(R"({"na\nme": "a"})")), HasSubstr(R"(na\nme: unknown key)"));
  EXPECT_THAT(error_of(write(std::string(100000, '['))), HasSubstr("nested deeper than 32 levels"));
  EXPECT_THAT(error_of(write(R"({"a":)" + std::string(40, '[') + std::string(40, ']') + "}")),
              HasSubstr("nested deeper than 32 levels"));
}

TEST_F(SceneTest, RefusesDamagedFiles) {
  write("no picture", "p.exr");
  EXPECT_THAT(error_at("/environment", {{"image", "p.exr"}}), HasSubstr("environment.image: "));
  write("v 0 0\nf 1 2 3\n", "m.obj");
  EXPECT_THAT(error_at("/objects/0/shape", {{"type", "mesh"}, {"file", "m.obj"}}),
              HasSubstr("objects[0].shape.file: "));
  write("x", "v.npy");
  EXPECT_THAT(error_at("/objects/0/shape", {{"type", "mesh"}, {"vertices", "v.npy"}, {"triangles", "v.npy"}}),
              HasSubstr("v.npy: not a .npy file of version 1.0"));
  const std::vector<float> triangle{0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::vector<std::int32_t> indices{0, 1, 3};
  write_npy(folder_ / "v.npy", triangle.data(), 3, 3);
  write_npy(folder_ / "t.npy", indices.data(), 1, 3);
  const json shape{{"type", "mesh"}, {"vertices", "v.npy"}, {"triangles", "t.npy"}};
  EXPECT_THAT(error_at("/objects/0/shape", shape), HasSubstr("triangle 0 uses vertex 3 of 3"));
  EXPECT_THAT(error_at("/objects/0/shape", {{"type", "mesh"}, {"vertices", "t.npy"}, {"triangles", "t.npy"}}),
              HasSubstr("expected a C-ordered array of <f4 of shape (n, 3)"));
  fs::resize_file(folder_ / "v.npy", fs::file_size(folder_ / "v.npy") - 4);
  EXPECT_THAT(error_at("/objects/0/shape", shape), HasSubstr("3 rows need 36 bytes of data, the file has 32"));
}

std::string contents(const fs::path& path) {
  std::stringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

TEST_F(SceneTest, ResolvedSceneIsTheSame) {
  json scene = valid();
  scene["objects"].push_back({{"name", "floor"},
                              {"shape", {{"type", "quad"}, {"size", {4, 4}}}},
                              {"material", "tiles"},
                              {"camera_only", true}});
  scene["materials"]["tiles"] = json::parse(
      R"({"model": "lambert", "parameters": {"rho": {"texture":
          {"procedural": "checker", "a": [0.1, 0.2, 0.3], "b": [0.4, 0.5, 0.6], "cells": 3}}}})");
  scene["environment"] = {{"procedural", "interior"}, {"width", 16}, {"strength", 2}};
  const Scene a = load_scene(write(scene.dump()));
  write_resolved(a, folder_ / "out");
  const Scene b = load_scene(folder_ / "out" / "scene.json");
  EXPECT_EQ(a.hash, b.hash);
  EXPECT_EQ(a.resolved, b.resolved);
  ASSERT_EQ(b.objects.size(), 2u);
  EXPECT_EQ(a.objects[0].mesh->vertices, b.objects[0].mesh->vertices);
  EXPECT_EQ(a.objects[0].mesh->normals, b.objects[0].mesh->normals);
  EXPECT_EQ(a.objects[1].mesh->uvs, b.objects[1].mesh->uvs);
  EXPECT_EQ(a.objects[1].mesh->triangles, b.objects[1].mesh->triangles);
  EXPECT_TRUE(b.objects[1].camera_only);
  EXPECT_EQ(a.environment.image->rgb, b.environment.image->rgb);
  EXPECT_EQ(a.materials[1].textures.at("rho")->rgb, b.materials[1].textures.at("rho")->rgb);
  // Nothing procedural is left, and a second run writes the same bytes.
  const std::string text = contents(folder_ / "out" / "scene.json");
  EXPECT_THAT(text, AllOf(Not(HasSubstr("procedural")), Not(HasSubstr("sphere"))));
  write_resolved(a, folder_ / "again");
  for (const auto& entry : fs::directory_iterator(folder_ / "out"))
    EXPECT_EQ(contents(entry.path()), contents(folder_ / "again" / entry.path().filename())) << entry.path();
}

TEST_F(SceneTest, AnEnvironmentIsTurnedCounterclockwise) {
  json scene = valid();
  const auto image_at = [&](double degrees) {
    scene["environment"] = {{"procedural", "interior"}, {"width", 16}, {"rotate_degrees", degrees}};
    return *load_scene(write(scene.dump())).environment.image;
  };
  const Image before = image_at(0), after = image_at(90), back = image_at(-270), nearly = image_at(-359.9);
  EXPECT_EQ(after.rgb, back.rgb);
  EXPECT_EQ(before.rgb, nearly.rgb);
  // What lay towards +x, in the middle of the picture, lies towards +y, a quarter of the width to the left.
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 16; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(after.pixel(x, y)[c], before.pixel((x + 4) % 16, y)[c]);
  EXPECT_NE(before.rgb, after.rgb);
}

TEST_F(SceneTest, HashSeesContentsNotSettings) {
  const std::string hash = load_scene(write(valid().dump())).hash;
  EXPECT_EQ(hash.size(), 16u);
  json scene = valid();
  scene["settings"]["spp"] = 99;
  scene["description"] = "another text";
  EXPECT_EQ(load_scene(write(scene.dump())).hash, hash);
  for (const auto& [pointer, value] : std::vector<std::pair<std::string, json>>{{"/objects/0/shape/radius", 1.5},
                                                                                {"/materials/red/parameters/rho", 0.3},
                                                                                {"/lights/0/power", 11},
                                                                                {"/camera/fov_y_degrees", 41},
                                                                                {"/environment/strength", 0.6}}) {
    json changed = valid();
    changed[json::json_pointer(pointer)] = value;
    EXPECT_NE(load_scene(write(changed.dump())).hash, hash) << pointer;
  }
}

TEST_F(SceneTest, ReadsMeshFiles) {
  const std::string obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n";
  write(obj, "q.obj");
  const Mesh quad = read_mesh(folder_ / "q.obj", false);
  EXPECT_EQ(quad.triangles.size(), 2u);
  EXPECT_EQ(quad.uvs.size(), quad.vertices.size());
  EXPECT_TRUE(quad.normals.empty());
  const Mesh smooth = read_mesh(folder_ / "q.obj", true);
  ASSERT_EQ(smooth.normals.size(), smooth.vertices.size());
  for (const auto& n : smooth.normals) EXPECT_FLOAT_EQ(n[2], 1);
  write(
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n2 0 0\n0 3 0\n3 0 1 2\n",
      "t.ply");
  EXPECT_EQ(read_mesh(folder_ / "t.ply", false).triangles.size(), 1u);
}

/// The sum of signed volumes; for a closed mesh whose triangles face outwards it is 6 times its volume.
double volume(const Mesh& m) {
  double sum = 0;
  for (const auto& t : m.triangles) {
    const auto v = [&](int i) { return Vec3<double>{m.vertices[t[i]][0], m.vertices[t[i]][1], m.vertices[t[i]][2]}; };
    sum += dot(v(0), cross(v(1), v(2))) / 6;
  }
  return sum;
}

TEST(Mesh, ShapesFaceOutwards) {
  EXPECT_NEAR(volume(make_sphere(2, 256, 128, true)), 4.0 / 3 * kPi * 8, 0.01);
  EXPECT_NEAR(volume(make_box({2, 3, 4})), 24, 1e-6);
  for (const Mesh& m : {make_quad(2, 3), make_disk(1, 16)})
    for (const auto& t : m.triangles) {
      const auto &a = m.vertices[t[0]], &b = m.vertices[t[1]], &c = m.vertices[t[2]];
      EXPECT_GT((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]), 0);
    }
  check_mesh(make_sphere(1, 3, 2, true), "smallest sphere");
  EXPECT_EQ(make_sphere(1, 3, 2, true).triangles.size(), 6u);
}

/// The largest angle between a corner's normal and its triangle's.
double largest_lean(const Mesh& m) {
  double largest = 0;
  for (const auto& t : m.triangles) {
    const auto at = [&](const auto& list, int i) { return Vec3<double>{list[t[i]][0], list[t[i]][1], list[t[i]][2]}; };
    const auto a = at(m.vertices, 0), b = at(m.vertices, 1), c = at(m.vertices, 2);
    const Vec3<double> face = normalize(cross(b - a, c - a));
    for (int i = 0; i < 3; ++i) largest = std::max(largest, acos(std::clamp(dot(face, at(m.normals, i)), -1.0, 1.0)));
  }
  return largest;
}

TEST(Mesh, ACylinderIsClosedAndRoundOnlyOnItsSide) {
  const Mesh smooth = make_cylinder(0.5, 3, 256, true), flat = make_cylinder(0.5, 3, 256, false);
  check_mesh(smooth, "cylinder");
  EXPECT_NEAR(volume(smooth), kPi * 0.25 * 3, 1e-3);
  EXPECT_NEAR(volume(flat), volume(smooth), 1e-6);
  EXPECT_NEAR(largest_lean(smooth), kPi / 256, 1e-4) << "half a segment's angle";
  EXPECT_LT(largest_lean(flat), 1e-3);
}

/// Pappus: a tube of radius r(t) about a curve has the volume pi r^2 along the curve, whatever its curvature.
TEST(Mesh, AKnotIsClosedAndHasNormalsOfItsSurface) {
  const Mesh knot = make_knot(2, 3, 0.2, 48, 4096, 64);
  check_mesh(knot, "knot");
  EXPECT_EQ(knot.triangles.size(), 524'288u);
  double length = 0;
  Vec3<double> last;
  constexpr int kSteps = 100'000;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = 2 * kPi * i / kSteps, r = 1 + 0.4 * cos(3 * t);
    const Vec3<double> p{r * cos(2 * t), r * sin(2 * t), 0.4 * sin(3 * t)};
    if (i > 0) length += sqrt(dot(p - last, p - last));
    last = p;
  }
  // The mean of (1 + cos(x) / 4)^2
  EXPECT_NEAR(volume(knot) / (kPi * 0.04 * length * (1 + 1.0 / 32)), 1, 0.01);
  EXPECT_LT(largest_lean(knot), 0.15) << "a side's angle is 0.098";
  EXPECT_EQ(knot.vertices.front(), knot.vertices[64]) << "closed around the tube";
  EXPECT_EQ(knot.vertices.front(), knot.vertices[knot.vertices.size() - 65]) << "closed along the tube";
}

TEST(Mesh, TilesHaveTheReliefThatIsAskedForAndMeetInJoints) {
  constexpr int kCount = 4, kResolution = 64, kSide = kCount * kResolution;
  const Mesh tiles = make_tiles(kCount, 0.002, 0.02, kResolution, 1);
  check_mesh(tiles, "tiles");
  EXPECT_EQ(tiles.triangles.size(), 2u * kSide * kSide);
  EXPECT_LT(largest_lean(tiles), atan(1.5 * (0.005 + 3 * 0.002) / 0.02 + 0.1))
      << "the joint's depth and three times the relief within its width";
  double squares = 0;
  int count = 0;
  for (int j = 0; j <= kSide; ++j)
    for (int i = 0; i <= kSide; ++i) {
      const double z = tiles.vertices[std::size_t(j) * (kSide + 1) + i][2];
      const bool joint = i % kResolution == 0 || j % kResolution == 0;
      if (joint) {
        ASSERT_EQ(z, 0);
      } else if (i % kResolution > 4 && i % kResolution < 60 && j % kResolution > 4 && j % kResolution < 60) {
        squares += (z - 0.005) * (z - 0.005);
        ++count;
      }
    }
  EXPECT_NEAR(sqrt(squares / count), 0.002, 0.0004);
  EXPECT_NE(make_tiles(1, 0.002, 0.02, 8, 1).vertices, make_tiles(1, 0.002, 0.02, 8, 2).vertices);
  EXPECT_EQ(make_tiles(1, 0.002, 0.02, 8, 1).vertices, make_tiles(1, 0.002, 0.02, 8, 1).vertices);
}

TEST(Procedural, EquirectangularRoundTrip) {
  double u, v;
  direction_to_equirectangular({1, 0, 0}, u, v);
  EXPECT_DOUBLE_EQ(u, 0.5);
  EXPECT_DOUBLE_EQ(v, 0.5);
  direction_to_equirectangular({0, 1, 0}, u, v);
  EXPECT_DOUBLE_EQ(u, 0.25);
  direction_to_equirectangular({0, 0, 1}, u, v);
  EXPECT_DOUBLE_EQ(v, 1);
  for (double s = 0.01; s < 1; s += 0.07)
    for (double t = 0.01; t < 1; t += 0.07) {
      direction_to_equirectangular(equirectangular_to_direction(s, t), u, v);
      EXPECT_NEAR(u, s, 1e-14);
      EXPECT_NEAR(v, t, 1e-14);
    }
}

TEST(Procedural, EnvironmentsHaveBrightSharpFeatures) {
  for (const char* name : {"sky", "interior"}) {
    const Image image = procedural_environment(name, 256);
    double mean = 0, max = 0;
    for (const float x : image.rgb) {
      EXPECT_GE(x, 0);
      mean += x / double(image.rgb.size());
      max = std::max(max, double(x));
    }
    EXPECT_GT(max, 10 * mean) << name;
  }
}

TEST(SceneFiles, AllLoad) {
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(BRDFC_SOURCE_DIR) / "scenes"))
    if (entry.path().extension() == ".json" && entry.path().filename() != "schema.json") files.insert(entry.path());
  EXPECT_GE(files.size(), 6u);
  for (const fs::path& file : third_of(files)) {
    const Scene scene = load_scene(file);
    EXPECT_EQ(scene.name, file.stem().string());
    EXPECT_FALSE(scene.description.empty()) << file;
  }
}

/// The documented keys are those that the loader accepts: its error for an unknown key lists them.
TEST_F(SceneTest, SchemaListsTheKeysOfTheLoader) {
  const json schema = read_json(fs::path(BRDFC_SOURCE_DIR) / "scenes" / "schema.json");
  struct Case {
    const char* definition;  // "" for the scene itself
    const char* pointer;     // of an object of this kind
    json value;              // added first, unless null
  };
  const json checker{{"procedural", "checker"}, {"a", {0, 0, 0}}, {"b", {1, 1, 1}}, {"cells", 2}};
  const std::vector<Case> cases{
      {"", "", nullptr},
      {"settings", "/settings", nullptr},
      {"perspective", "/camera", nullptr},
      {"orthographic",
       "/camera",
       {{"type", "orthographic"}, {"position", {0, 0, 9}}, {"look_at", {0, 1, 0}}, {"height", 2}}},
      {"material", "/materials/red", nullptr},
      {"measured_material", "/materials/red", {{"measured", "a.binary"}}},
      {"sum_material", "/materials/red", {{"sum", json::array({{{"model", "lambert"}}})}}},
      {"layers_material", "/materials/red", {{"layers", json::array({{{"model", "lambert"}}})}}},
      {"lobe", "/materials/mixed/layers/0", {{"model", "lambert"}}},
      {"textured", "/materials/red/parameters/rho", {{"texture", checker}}},
      {"image_texture", "/materials/red/parameters/rho/texture", {{"image", "a.png"}}},
      {"checker_texture", "/materials/red/parameters/rho/texture", checker},
      {"object", "/objects/0", nullptr},
      {"transform", "/objects/0/transform", nullptr},
      {"sphere", "/objects/0/shape", {{"type", "sphere"}}},
      {"quad", "/objects/0/shape", {{"type", "quad"}}},
      {"disk", "/objects/0/shape", {{"type", "disk"}}},
      {"box", "/objects/0/shape", {{"type", "box"}}},
      {"cylinder", "/objects/0/shape", {{"type", "cylinder"}}},
      {"knot", "/objects/0/shape", {{"type", "knot"}}},
      {"tiles", "/objects/0/shape", {{"type", "tiles"}}},
      {"mesh_file", "/objects/0/shape", {{"type", "mesh"}, {"file", "a.obj"}}},
      {"mesh_arrays", "/objects/0/shape", {{"type", "mesh"}, {"vertices", "a.npy"}}},
      {"point_light", "/lights/0", nullptr},
      {"sun_light", "/lights/1", nullptr},
      {"area_light", "/lights/2", nullptr},
      {"disk_light", "/lights/3", nullptr},
      {"constant_environment", "/environment", nullptr},
      {"image_environment", "/environment", {{"image", "a.exr"}}},
      {"procedural_environment", "/environment", {{"procedural", "sky"}}},
  };
  std::size_t objects = 1;
  for (const auto& [name, definition] : schema["$defs"].items()) objects += definition.value("type", "") == "object";
  EXPECT_EQ(objects, cases.size());
  for (const Case& c : cases) {
    json scene = valid();
    if (std::string(c.pointer).ends_with("/texture")) scene["materials"]["red"]["parameters"]["rho"] = json::object();
    json& object = scene[json::json_pointer(c.pointer)];
    if (!c.value.is_null()) object = c.value;
    object["zzz"] = 1;
    const std::string error = error_with(scene);
    const std::string before = "unknown key, expected one of ";
    ASSERT_THAT(error, HasSubstr("zzz: " + before)) << c.definition;
    std::set<std::string> accepted, documented;
    std::stringstream list(error.substr(error.find(before) + before.size()));
    for (std::string key; std::getline(list, key, ',');) accepted.insert(key.substr(key.find_first_not_of(' ')));
    const json& definition = *c.definition ? schema["$defs"][c.definition] : schema;
    EXPECT_EQ(definition["additionalProperties"], false);
    for (const auto& [key, value] : definition["properties"].items()) documented.insert(key);
    EXPECT_EQ(accepted, documented) << c.definition;
  }
  json scene = valid();
  for (const json& name : schema["properties"]["working_space"]["enum"]) {
    scene["working_space"] = name;
    EXPECT_EQ(load_scene(write(scene.dump())).working_space, name);
  }
  scene["working_space"] = "Rec.77";
  EXPECT_THAT(error_with(scene),
              HasSubstr("working_space: expected one of Linear Rec.709, Linear Rec.2020, ACEScg, found \"Rec.77\""));
}

}  // namespace
}  // namespace brdfc::reference
