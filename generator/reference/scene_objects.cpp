// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the objects of a scene file: shapes, transforms, and the material of each.
#include <algorithm>
#include <cmath>
#include <set>

#include "core/json_text.h"
#include "core/text.h"
#include "reference/scene_files.h"
#include "reference/shape_reader.h"

namespace brdfc::reference {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

class ObjectReader {
 public:
  explicit ObjectReader(SceneFiles& files) : files_(files), scene_(files.scene) {}

  void read(const JsonView& j) {
    j.only({"name", "shape", "transform", "material", "camera_only"});
    Object object;
    object.name = j.at("name").text();
    json resolved{{"name", object.name}};
    double size = 1;
    const Shape& shape = read_shape(j.at("shape"), size);
    object.mesh = shape.mesh;
    resolved["shape"] = shape.resolved;
    object.transform = read_transform(j.find("transform"), size, resolved["transform"]);
    const JsonView material = j.at("material");
    const std::string id = material.text();
    const auto& list = scene_.materials;
    const auto found = std::find_if(list.begin(), list.end(), [&](const Material& m) { return m.id == id; });
    if (found == list.end()) {
      std::vector<std::string> known;
      for (const Material& m : list) known.push_back(m.id);
      material.fail(fmt::format("one of the materials {}", join(known, ", ")));
    }
    object.material = int(found - list.begin());
    if (!found->textures.empty() && object.mesh->uvs.empty())
      files_.note(fmt::format(
          "{}: the mesh has no UVs: the textures of \"{}\" show the colour of their lower left corner", j.key(), id));
    resolved["material"] = id;
    if (const auto v = j.find("camera_only")) object.camera_only = v->boolean();
    resolved["camera_only"] = object.camera_only;
    scene_.resolved["objects"].push_back(std::move(resolved));
    scene_.objects.push_back(std::move(object));
  }

 private:
  /// A mesh for objects, and its description in the resolved scene.
  struct Shape {
    std::shared_ptr<const Mesh> mesh;
    json resolved;
  };

  /// Shapes with the same JSON text are read or made once. Many spheres that differ in their radius share a unit
  /// sphere, which the transform has to scale by `size`.
  const Shape& read_shape(const JsonView& j, double& size) {
    std::string text = json_text(j.json());
    if (const auto known = shapes_.find(text); known != shapes_.end()) return known->second;
    std::vector<std::string> types = shape_types();
    types.push_back("mesh");
    const std::string type = j.at("type").choice(types);
    Mesh mesh;
    if (type == "sphere" && triangles_of_spheres_ > kMostCopies) {
      size = read_radius(j);
      json unit = j.json();
      unit["radius"] = 1;
      text = json_text(unit);
      if (const auto known = shapes_.find(text); known != shapes_.end()) return known->second;
      mesh = read_unit_sphere(j);
    } else if (type != "mesh") {
      mesh = read_shape_of_numbers(j, type);
      if (type == "sphere") triangles_of_spheres_ += mesh.triangles.size();
    } else if (j.has("file")) {
      j.only({"type", "file", "smooth", "of_material"});
      const auto smooth = j.find("smooth"), of_material = j.find("of_material");
      const bool s = smooth ? smooth->boolean() : true;
      const std::string part = of_material ? of_material->text() : "";
      std::vector<std::string> notes;
      mesh = files_.read_file(j.at("file"), [&](const fs::path& f) { return read_mesh(f, s, part, &notes); });
      for (const std::string& text : notes) files_.note(text);
    } else {
      j.only({"type", "vertices", "normals", "uvs", "triangles"});
      read_array(j.at("vertices"), mesh.vertices);
      read_array(j.at("triangles"), mesh.triangles);
      if (const auto v = j.find("normals")) read_array(*v, mesh.normals);
      if (const auto v = j.find("uvs")) read_array(*v, mesh.uvs);
      try {
        check_mesh(mesh, "mesh");
      } catch (const InputError& e) {
        j.error(e.what());
      }
    }
    std::string stem;
    const auto kept = files_.keep(std::move(mesh), stem);
    Shape& shape = shapes_[text];
    shape.mesh = kept;
    json& resolved = shape.resolved;
    resolved = {{"type", "mesh"}, {"vertices", stem + "_vertices.npy"}, {"triangles", stem + "_triangles.npy"}};
    if (!kept->normals.empty()) resolved["normals"] = stem + "_normals.npy";
    if (!kept->uvs.empty()) resolved["uvs"] = stem + "_uvs.npy";
    return shape;
  }

  template <class T, std::size_t N> void read_array(const JsonView& j, std::vector<std::array<T, N>>& out) {
    const auto flat = files_.read_file(j, [](const fs::path& f) { return read_npy<T>(f, N); });
    out.resize(flat.size() / N);
    for (std::size_t i = 0; i < flat.size(); ++i) out[i / N][i % N] = flat[i];
  }

  /// The order is scale, rotation about x, about y, about z (Blender's "XYZ"), translation.
  /// `size` is a further factor of the scale.
  static Transform read_transform(const std::optional<JsonView>& j, double size, json& resolved) {
    std::array<double, 3> translate{0, 0, 0}, rotate{0, 0, 0}, scale{1, 1, 1};
    if (j) {
      j->only({"translate", "rotate_degrees", "scale"});
      if (const auto v = j->find("translate")) translate = v->numbers<3>(-kFar, kFar);
      if (const auto v = j->find("rotate_degrees")) rotate = v->numbers<3>(-3600, 3600);
      if (const auto v = j->find("scale")) {
        if (v->json().is_number())
          scale.fill(v->number(kSmall, kFar));
        else
          scale = v->numbers<3>(kSmall, kFar);
      }
    }
    for (double& s : scale) s *= size;
    resolved = {{"translate", translate}, {"rotate_degrees", rotate}, {"scale", scale}};
    Transform t;
    t.translation = vector_of(translate);
    // Exact at multiples of a right angle, so that axis-aligned objects stay so.
    const auto sine = [](double degrees) {
      const double r = std::remainder(degrees, 360.0);
      return r == 0 || abs(r) == 180 ? 0.0 : r == 90 ? 1.0 : r == -90 ? -1.0 : sin(r * kPi / 180);
    };
    std::array<double, 3> s, c;
    for (int i = 0; i < 3; ++i) s[i] = sine(rotate[i]), c[i] = sine(rotate[i] + 90);
    const std::array<std::array<double, 3>, 3> r{
        {{c[2] * c[1], c[2] * s[1] * s[0] - s[2] * c[0], c[2] * s[1] * c[0] + s[2] * s[0]},
         {s[2] * c[1], s[2] * s[1] * s[0] + c[2] * c[0], s[2] * s[1] * c[0] - c[2] * s[0]},
         {-s[1], c[1] * s[0], c[1] * c[0]}}};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) t.matrix[i][k] = r[i][k] * scale[k];
    return t;
  }

  SceneFiles& files_;
  Scene& scene_;
  std::map<std::string, Shape> shapes_;   // by their JSON text
  std::size_t triangles_of_spheres_ = 0;  // of those that have a mesh of their own
};

}  // namespace

void read_objects(const JsonView& j, SceneFiles& files) {
  ObjectReader reader(files);
  files.scene.resolved["objects"] = json::array();
  std::set<std::string> names;
  for (const JsonView& object : j.elements()) {
    reader.read(object);
    if (!names.insert(files.scene.objects.back().name).second)
      object.at("name").error("\"" + files.scene.objects.back().name + "\" is the name of an earlier object");
  }
}

}  // namespace brdfc::reference
