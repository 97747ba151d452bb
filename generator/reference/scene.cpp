// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/scene.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/json_text.h"
#include "core/write_beside.h"
#include "reference/json_view.h"
#include "reference/procedural.h"
#include "reference/scene_files.h"
#include "reference/shape_reader.h"

namespace brdfc::reference {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

class Loader {
 public:
  explicit Loader(const fs::path& path) : files_(path), json_(read_json(path)) {}

  UsedMaterials load_materials() {
    const JsonView root(json_, files_.path().string());
    root.only({"$schema", "materials", "sizeless_lamps", "lamps"});
    read_materials(root.at("materials"), files_, true);
    UsedMaterials used{std::move(scene_.materials), {}, {}};
    if (const auto lamps = root.find("lamps")) used.lamps = lamps->integer(0, 1000000);
    if (const auto lamps = root.find("sizeless_lamps"))
      for (const JsonView& lamp : lamps->elements()) used.sizeless_lamps.push_back(lamp.text());
    return used;
  }

  Scene load() {
    const JsonView root(json_, files_.path().string());
    root.only({"$schema", "name", "description", "working_space", "settings", "camera", "materials", "objects",
               "lights", "environment"});
    scene_.name = root.at("name").text();
    scene_.resolved["name"] = scene_.name;
    if (const auto description = root.find("description")) scene_.description = description->text();
    if (const auto space = root.find("working_space")) files_.read_working_space(*space);
    read_camera(root.at("camera"));
    read_materials(root.at("materials"), files_, false);
    read_objects(root.at("objects"), files_);
    scene_.resolved["lights"] = json::array();
    if (const auto lights = root.find("lights"))
      for (const JsonView& light : lights->elements()) read_light(light, files_);
    read_environment(root.find("environment"), files_);

    scene_.hash = short_hash(json_text(scene_.resolved));
    if (!scene_.description.empty()) scene_.resolved["description"] = scene_.description;
    if (const auto settings = root.find("settings")) read_settings(*settings);
    const RenderSettings& s = scene_.settings;
    scene_.resolved["settings"] = {
        {"width", s.width}, {"height", s.height},           {"spp", s.spp},
        {"seed", s.seed},   {"max_bounces", s.max_bounces}, {"scale_radiance", s.scale_radiance}};
    // Only settings other than the defaults are listed: Blender has its own patterns and strategies.
    if (s.pattern != Pattern::Random) scene_.resolved["settings"]["pattern"] = pattern_names()[std::size_t(s.pattern)];
    if (s.strategy != Strategy::Mis)
      scene_.resolved["settings"]["strategy"] = strategy_names()[std::size_t(s.strategy)];
    return std::move(scene_);
  }

 private:
  void read_settings(const JsonView& j) {
    j.only({"width", "height", "spp", "seed", "max_bounces", "scale_radiance", "pattern", "strategy"});
    RenderSettings& s = scene_.settings;
    if (const auto v = j.find("width")) s.width = v->integer(1, 16384);
    if (const auto v = j.find("height")) s.height = v->integer(1, 16384);
    if (const auto v = j.find("spp")) s.spp = v->integer(1, 10000000);
    if (const auto v = j.find("seed")) s.seed = v->integer(0, 2147483647);
    if (const auto v = j.find("max_bounces")) s.max_bounces = v->integer(0, 1024);
    if (const auto v = j.find("scale_radiance")) s.scale_radiance = v->boolean();
    if (const auto v = j.find("strategy")) s.strategy = strategy_named(v->choice(strategy_names()));
    if (const auto v = j.find("pattern")) s.pattern = pattern_named(v->choice(pattern_names()));
  }

  void read_camera(const JsonView& j) {
    Camera& c = scene_.camera;
    c.orthographic = j.at("type").choice({"perspective", "orthographic"}) == "orthographic";
    const std::string extent = c.orthographic ? "height" : "fov_y_degrees";
    j.only({"type", "position", "look_at", "up", extent});
    c.position = vector_of(j.at("position").numbers<3>(-kFar, kFar));
    const Vec3<double> target = vector_of(j.at("look_at").numbers<3>(-kFar, kFar));
    Vec3<double> up{0, 0, 1};
    if (const auto v = j.find("up")) up = vector_of(v->numbers<3>(-kFar, kFar));
    const Vec3<double> view = target - c.position;
    if (!(length(view) > kSmall)) j.at("look_at").fail("a point away from the camera's position");
    c.forward = normalize(view);
    const Vec3<double> side = cross(c.forward, up);
    if (!(length(side) > 1e-6 * length(up))) j.error("expected \"up\" not to be parallel to the view");
    c.right = normalize(side);
    c.up = cross(c.right, c.forward);
    const JsonView size = j.at(extent);
    c.half_height = c.orthographic ? size.number(kSmall, kFar) / 2 : tan(size.number(0.001, 175) * kPi / 360);
    json& out = scene_.resolved["camera"] = j.json();
    out["up"] = {up.x, up.y, up.z};
  }

  SceneFiles files_;
  Scene& scene_ = files_.scene;
  json json_;
};

template <class T, std::size_t N> void write_array(const fs::path& path, const std::vector<std::array<T, N>>& data) {
  if (!data.empty()) write_npy(path, data.front().data(), data.size(), N);
}

}  // namespace

Vec3<double> Transform::vector(const Vec3<double>& v) const {
  const auto row = [&](int i) { return matrix[i][0] * v.x + matrix[i][1] * v.y + matrix[i][2] * v.z; };
  return {row(0), row(1), row(2)};
}

Vec3<double> Transform::normal(const Vec3<double>& n) const {
  const Vec3<double> a{matrix[0][0], matrix[1][0], matrix[2][0]}, b{matrix[0][1], matrix[1][1], matrix[2][1]},
      c{matrix[0][2], matrix[1][2], matrix[2][2]};
  return normalize(cross(b, c) * n.x + cross(c, a) * n.y + cross(a, b) * n.z);
}

Rgb<double> Environment::radiance(const Vec3<double>& direction) const {
  if (!image) return color;
  double u, v;
  direction_to_equirectangular(direction, u, v);
  return radiance(u, v);
}

const std::vector<std::string>& strategy_names() {
  static const std::vector<std::string> names{"mis", "brdf", "light"};
  return names;
}

Strategy strategy_named(const std::string& name) {
  return Strategy(std::ranges::find(strategy_names(), name) - strategy_names().begin());
}

Scene load_scene(const fs::path& path) { return Loader(path).load(); }

UsedMaterials load_materials(const fs::path& path) { return Loader(path).load_materials(); }

void write_resolved(const Scene& scene, const fs::path& folder) {
  for (const auto& [stem, mesh] : scene.mesh_files) {
    write_array(folder / (stem + "_vertices.npy"), mesh->vertices);
    write_array(folder / (stem + "_normals.npy"), mesh->normals);
    write_array(folder / (stem + "_uvs.npy"), mesh->uvs);
    write_array(folder / (stem + "_triangles.npy"), mesh->triangles);
  }
  for (const auto& [name, image] : scene.image_files) write_image(folder / name, *image);
  write_beside(folder / "scene.json", [&](const fs::path& temporary) {
    std::ofstream out(temporary);
    out << json_text(scene.resolved, 2) << '\n';
    out.close();
    if (!out) input_error("{}: can't write", (folder / "scene.json").string());
  });
}

}  // namespace brdfc::reference
