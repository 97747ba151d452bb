// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/scene.h"

#include <OpenImageIO/hash.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>

#include "model/optical.h"
#include "reference/color.h"
#include "reference/json_view.h"
#include "reference/procedural.h"
#include "reference/shape_reader.h"

namespace brdfc::reference {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr double kBright = 1e9;  // largest power, irradiance or radiance

using Vector = Vec3<double>;

Vector vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

class Hasher {
 public:
  template <class T> void add(const std::vector<T>& data) {
    const std::uint64_t size = data.size();
    state_ = OIIO::xxhash::XXH64(&size, sizeof(size), state_);
    state_ = OIIO::xxhash::XXH64(data.data(), data.size() * sizeof(T), state_);
  }
  void add(const std::string& text) { state_ = OIIO::xxhash::XXH64(text.data(), text.size(), state_); }
  std::string hex() const { return fmt::format("{:016x}", state_); }

 private:
  unsigned long long state_ = 0;
};

std::string mesh_name(const Mesh& mesh) {
  Hasher hash;
  hash.add(mesh.vertices);
  hash.add(mesh.normals);
  hash.add(mesh.uvs);
  hash.add(mesh.triangles);
  return "mesh_" + hash.hex();
}

std::string image_name(const Image& image) {
  Hasher hash;
  hash.add(std::vector<int>{image.width, image.height});
  hash.add(image.rgb);
  return "image_" + hash.hex() + ".exr";
}

class Loader {
 public:
  explicit Loader(const fs::path& path) : path_(path), json_(read_json(path)) {}

  UsedMaterials load_materials() {
    const JsonView root(json_, path_.string());
    root.only({"$schema", "materials", "sizeless_lamps", "lamps"});
    materials_alone_ = true;
    read_materials(root.at("materials"));
    UsedMaterials used{std::move(scene_.materials), {}, {}};
    if (const auto lamps = root.find("lamps")) used.lamps = lamps->integer(0, 1000000);
    if (const auto lamps = root.find("sizeless_lamps"))
      for (const JsonView& lamp : lamps->elements()) used.sizeless_lamps.push_back(lamp.text());
    return used;
  }

  Scene load() {
    const JsonView root(json_, path_.string());
    root.only({"$schema", "name", "description", "working_space", "settings", "camera", "materials", "objects",
               "lights", "environment"});
    scene_.name = root.at("name").text();
    scene_.resolved["name"] = scene_.name;
    if (const auto description = root.find("description")) scene_.description = description->text();
    if (const auto space = root.find("working_space")) read_working_space(*space);
    read_camera(root.at("camera"));
    read_materials(root.at("materials"));
    scene_.resolved["objects"] = json::array();
    std::set<std::string> names;
    for (const JsonView& object : root.at("objects").elements()) {
      read_object(object);
      if (!names.insert(scene_.objects.back().name).second)
        object.at("name").error("\"" + scene_.objects.back().name + "\" is the name of an earlier object");
    }
    scene_.resolved["lights"] = json::array();
    if (const auto lights = root.find("lights"))
      for (const JsonView& light : lights->elements()) read_light(light);
    read_environment(root.find("environment"));

    Hasher hash;
    hash.add(scene_.resolved.dump());
    scene_.hash = hash.hex();
    if (!scene_.description.empty()) scene_.resolved["description"] = scene_.description;
    if (const auto settings = root.find("settings")) read_settings(*settings);
    const RenderSettings& s = scene_.settings;
    scene_.resolved["settings"] = {
        {"width", s.width}, {"height", s.height},           {"spp", s.spp},
        {"seed", s.seed},   {"max_bounces", s.max_bounces}, {"scale_radiance", s.scale_radiance}};
    // Blender has its own ways.
    if (s.pattern != Pattern::Random) scene_.resolved["settings"]["pattern"] = pattern_names()[std::size_t(s.pattern)];
    if (s.strategy != Strategy::Mis)
      scene_.resolved["settings"]["strategy"] = strategy_names()[std::size_t(s.strategy)];
    return std::move(scene_);
  }

 private:
  fs::path beside(const std::string& name) const {
    const fs::path file(name);
    return file.is_absolute() ? file : path_.parent_path() / file;
  }

  /// A file that can't be used is reported with the key that names it.
  template <class Read> auto read_file(const JsonView& where, Read read) -> decltype(read(fs::path())) {
    const fs::path file = beside(where.text());
    try {
      return read(file);
    } catch (const InputError& e) {
      where.error(e.what());
    }
  }

  void read_working_space(const JsonView& j) {
    std::vector<std::string> names;
    for (const WorkingSpace& s : working_spaces()) names.push_back(s.name);
    scene_.resolved["working_space"] = scene_.working_space = j.choice(names);
    try {
      with_working_space_.emplace(ColorConfig::current().with_working_space(scene_.working_space));
    } catch (const InputError& e) {
      j.error(e.what());
    }
  }

  const ColorConfig& colors() const { return with_working_space_ ? *with_working_space_ : ColorConfig::current(); }

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
    const Vector target = vector_of(j.at("look_at").numbers<3>(-kFar, kFar));
    Vector up{0, 0, 1};
    if (const auto v = j.find("up")) up = vector_of(v->numbers<3>(-kFar, kFar));
    const Vector view = target - c.position;
    if (!(length(view) > kSmall)) j.at("look_at").fail("a point away from the camera's position");
    c.forward = normalize(view);
    const Vector side = cross(c.forward, up);
    if (!(length(side) > 1e-6 * length(up))) j.error("expected \"up\" not to be parallel to the view");
    c.right = normalize(side);
    c.up = cross(c.right, c.forward);
    const JsonView size = j.at(extent);
    c.half_height = c.orthographic ? size.number(kSmall, kFar) / 2 : tan(size.number(0.001, 175) * kPi / 360);
    json& out = scene_.resolved["camera"] = j.json();
    out["up"] = {up.x, up.y, up.z};
  }

  /// Says something once.
  void note(const std::string& text) {
    if (std::ranges::find(scene_.notes, text) == scene_.notes.end()) scene_.notes.push_back(text);
  }

  std::shared_ptr<const Image> keep(Image image, std::string& name) {
    name = image_name(image);
    auto& slot = scene_.image_files[name];
    if (!slot) slot = std::make_shared<const Image>(std::move(image));
    return slot;
  }

  Image read_picture(const JsonView& j, const std::string& space) {
    std::vector<std::string> notes;
    Image image = read_file(j, [&](const fs::path& f) { return read_image(f, colors(), space, &notes); });
    for (const std::string& text : notes) note(text);
    return image;
  }

  /// What an image's "colorspace" says, "auto" without it.
  std::string read_colorspace(const JsonView& j) {
    const auto v = j.find("colorspace");
    if (!v) return "auto";
    const std::string space = v->text();
    std::vector<std::string> known{"auto", "linear", "srgb"};
    if (std::ranges::find(known, space) != known.end() || colors().has_space(space)) return space;
    for (const std::string& name : colors().spaces()) known.push_back(name);
    v->fail(fmt::format("one of {}", fmt::join(known, ", ")));
  }

  std::shared_ptr<const Image> read_texture(const JsonView& j, const ParamInfo& info, json& resolved) {
    Image image;
    if (j.json().is_object() && j.has("procedural")) {
      j.at("procedural").choice({"checker"});
      j.only({"procedural", "a", "b", "cells"});
      const auto a = j.at("a").numbers<3>(0, kBright), b = j.at("b").numbers<3>(0, kBright);
      image = checker_texture({a[0], a[1], a[2]}, {b[0], b[1], b[2]}, j.at("cells").integer(1, 256));
    } else {
      const bool named = j.json().is_string();
      if (!named) j.only({"image", "colorspace"});
      const JsonView file = named ? j : j.at("image");
      image = read_picture(file, named ? "auto" : read_colorspace(j));
      limit(image, info, beside(file.text()).string());
    }
    std::string name;
    auto kept = keep(std::move(image), name);
    resolved = {{"texture", {{"image", name}, {"colorspace", "linear"}}}};
    return kept;
  }

  static std::size_t channels_of(const ParamInfo& info) { return info.kind == ParamKind::Number ? 1 : 3; }

  /// What is beyond the range of the parameter becomes the end of it, as in the shaders.
  void limit(Image& image, const ParamInfo& info, const std::string& name) {
    std::size_t count = 0, first = 0;
    float worst = 0;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      for (std::size_t c = 0; c < channels_of(info); ++c) {
        float& x = image.rgb[i + c];
        const float inside = std::clamp(x, float(info.min), float(info.max));
        if (x == inside) continue;
        if (count++ == 0) first = i / 3, worst = x;
        x = inside;
      }
    if (count)
      note(
          fmt::format("{}: {} outside of [{:g}, {:g}], the range of \"{}\", the first {:g} at ({}, {}); taken for the "
                      "end of the range",
                      name, count == 1 ? "1 value is" : fmt::format("{} values are", count), info.min, info.max,
                      info.name, worst, first % image.width, first / image.width));
  }

  ParamValue read_value(const JsonView& j, const ParamInfo& info) {
    if (info.kind == ParamKind::Choice) return j.choice(info.choices);
    if (info.kind == ParamKind::Number) return j.number(info.min, info.max);
    if (j.json().is_number()) {
      const double grey = j.number(info.min, info.max);
      return std::array<double, 3>{grey, grey, grey};
    }
    return j.numbers<3>(info.min, info.max);
  }

  /// Those that a substance sets, in the working space.
  ParamValues optical_parameters(const JsonView& j, const ModelInfo& info, std::optional<double> thickness) {
    try {
      const Substance substance = find_substance(j.text(), path_.parent_path());
      for (const std::string& text : substance.notes) note(text);
      return parameters_of(
          info, substance, [&](const Xyz& xyz) { return colors().from_xyz(xyz); }, thickness);
    } catch (const InputError& e) {
      j.error(e.what());
    }
  }

  void read_materials(const JsonView& j) {
    json& out = scene_.resolved["materials"] = json::object();
    for (const auto& [id, m] : j.members()) {
      m.only({"model", "optical", "thickness", "parameters", "representation"});
      Material material;
      material.id = id;
      std::vector<std::string> names;
      for (const auto& [name, model] : models()) names.push_back(name);
      material.model = &find_model(m.at("model").choice(names));
      const ModelInfo& info = material.model->info();
      json& resolved = out[id] = {{"model", info.name}, {"parameters", json::object()}};
      if (const auto optical = m.find("optical")) {
        std::optional<double> thickness;
        if (const auto t = m.find("thickness")) thickness = t->number(kThinnest, kThickest);
        material.values = optical_parameters(*optical, info, thickness);
        for (const auto& [name, value] : material.values)
          resolved["parameters"][name] = std::visit([](const auto& v) { return json(v); }, value);
      } else if (const auto thickness = m.find("thickness")) {
        thickness->error("expected \"optical\" beside it, which says what absorbs");
      }
      const ParamValues of_substance = material.values;
      if (const auto parameters = m.find("parameters"))
        for (const auto& [name, value] : parameters->members()) {
          const ParamInfo* p = info.param(name);
          if (!p) {
            std::vector<std::string> known;
            for (const ParamInfo& each : info.params) known.push_back(each.name);
            value.error(fmt::format("{} has no such parameter, expected one of {}", info.name, fmt::join(known, ", ")));
          }
          if (of_substance.count(name)) value.error("\"optical\" says what it is, expected one of the two");
          if (materials_alone_ && value.json().is_object()) {
            value.only({"varies"});
            if (!value.at("varies").boolean()) value.at("varies").fail("true, or the parameter's value");
            material.varying.insert(name);
          } else if (value.json().is_object()) {
            value.only({"texture"});
            if (p->kind == ParamKind::Choice) value.error("a choice can't be textured");
            const auto image = read_texture(value.at("texture"), *p, resolved["parameters"][name]);
            material.values[name] = texture_mean(value, *p, *image);
            material.textures[name] = image;
          } else {
            material.values[name] = read_value(value, *p);
            resolved["parameters"][name] = value.json();
          }
        }
      if (const auto v = m.find("representation")) material.representation = v->text();
      resolved["representation"] = material.representation;
      try {
        material.values = complete(info, material.values);
      } catch (const InputError& e) {
        m.error(e.what());
      }
      scene_.materials.push_back(std::move(material));
    }
    if (scene_.materials.empty()) j.error("expected at least one material");
  }

  /// The mean, after a check that every texel is in the range of the parameter.
  static ParamValue texture_mean(const JsonView& j, const ParamInfo& info, const Image& image) {
    std::array<double, 3> sum{0, 0, 0};
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      for (std::size_t c = 0; c < channels_of(info); ++c) {
        const double x = image.rgb[i + c];
        if (!(x >= info.min && x <= info.max))
          j.error(fmt::format("the texture has the value {:g} at pixel ({}, {}), expected [{:g}, {:g}]", x,
                              i / 3 % image.width, i / 3 / image.width, info.min, info.max));
        sum[c] += x;
      }
    for (double& x : sum) x /= double(image.rgb.size() / 3);
    if (info.kind == ParamKind::Number) return sum[0];
    return sum;
  }

  /// A mesh as objects have it, and what the resolved scene says of it.
  struct Shape {
    std::shared_ptr<const Mesh> mesh;
    json resolved;
  };

  /// Shapes of the same text are read or made once.
  const Shape& read_shape(const JsonView& j) {
    const std::string text = j.json().dump();
    if (const auto known = shapes_.find(text); known != shapes_.end()) return known->second;
    std::vector<std::string> types = shape_types();
    types.push_back("mesh");
    const std::string type = j.at("type").choice(types);
    Mesh mesh;
    if (type != "mesh") {
      mesh = read_shape_of_numbers(j, type);
    } else if (j.has("file")) {
      j.only({"type", "file", "smooth", "of_material"});
      const auto smooth = j.find("smooth"), of_material = j.find("of_material");
      const bool s = smooth ? smooth->boolean() : true;
      const std::string part = of_material ? of_material->text() : "";
      std::vector<std::string> notes;
      mesh = read_file(j.at("file"), [&](const fs::path& f) { return read_mesh(f, s, part, &notes); });
      for (const std::string& text : notes) note(text);
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
    const std::string stem = mesh_name(mesh);
    Shape& shape = shapes_[text];
    json& resolved = shape.resolved;
    resolved = {{"type", "mesh"}, {"vertices", stem + "_vertices.npy"}, {"triangles", stem + "_triangles.npy"}};
    if (!mesh.normals.empty()) resolved["normals"] = stem + "_normals.npy";
    if (!mesh.uvs.empty()) resolved["uvs"] = stem + "_uvs.npy";
    auto& slot = scene_.mesh_files[stem];
    if (!slot) slot = std::make_shared<const Mesh>(std::move(mesh));
    shape.mesh = slot;
    return shape;
  }

  template <class T, std::size_t N> void read_array(const JsonView& j, std::vector<std::array<T, N>>& out) {
    const auto flat = read_file(j, [](const fs::path& f) { return read_npy<T>(f, N); });
    out.resize(flat.size() / N);
    for (std::size_t i = 0; i < flat.size(); ++i) out[i / N][i % N] = flat[i];
  }

  void read_object(const JsonView& j) {
    j.only({"name", "shape", "transform", "material", "camera_only"});
    Object object;
    object.name = j.at("name").text();
    json resolved{{"name", object.name}};
    const Shape& shape = read_shape(j.at("shape"));
    object.mesh = shape.mesh;
    resolved["shape"] = shape.resolved;
    object.transform = read_transform(j.find("transform"), resolved["transform"]);
    const JsonView material = j.at("material");
    const std::string id = material.text();
    const auto& list = scene_.materials;
    const auto found = std::find_if(list.begin(), list.end(), [&](const Material& m) { return m.id == id; });
    if (found == list.end()) {
      std::vector<std::string> known;
      for (const Material& m : list) known.push_back(m.id);
      material.fail(fmt::format("one of the materials {}", fmt::join(known, ", ")));
    }
    object.material = int(found - list.begin());
    if (!found->textures.empty() && object.mesh->uvs.empty())
      note(fmt::format("{}: the mesh has no UVs: the textures of \"{}\" show the colour of their lower left corner",
                       j.key(), id));
    resolved["material"] = id;
    if (const auto v = j.find("camera_only")) object.camera_only = v->boolean();
    resolved["camera_only"] = object.camera_only;
    scene_.resolved["objects"].push_back(std::move(resolved));
    scene_.objects.push_back(std::move(object));
  }

  /// First scale, then turn about x, then y, then z (Blender's "XYZ"), then move.
  static Transform read_transform(const std::optional<JsonView>& j, json& resolved) {
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
    resolved = {{"translate", translate}, {"rotate_degrees", rotate}, {"scale", scale}};
    Transform t;
    t.translation = vector_of(translate);
    // Exact at multiples of a right angle, so that axis-aligned things stay so.
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

  void read_light(const JsonView& j) {
    const std::string type = j.at("type").choice({"point", "sun", "area", "disk"});
    Light light;
    light.key = j.key();
    json resolved = j.json();
    Rgb<double> color(1, 1, 1);
    if (const auto v = j.find("color")) {
      const auto c = v->numbers<3>(0, kBright);
      color = {c[0], c[1], c[2]};
    }
    resolved["color"] = {color.r, color.g, color.b};
    if (const auto v = j.find("camera_visible")) light.camera_visible = v->boolean();
    resolved["camera_visible"] = light.camera_visible;
    if (type == "sun") {
      j.only({"type", "direction", "irradiance", "angle_degrees", "color", "camera_visible"});
      light.kind = Light::Kind::Sun;
      light.direction = read_direction(j.at("direction"));
      const double irradiance = j.at("irradiance").number(0, kBright);
      const auto angle = j.find("angle_degrees");
      const double degrees = angle ? angle->number(0, 180) : 0;
      resolved["angle_degrees"] = degrees;
      light.radius = sin(degrees * kPi / 360);
      light.intensity = color * irradiance;
      if (light.radius > 0) light.radiance = light.intensity / (kPi * sqr(light.radius));
    } else if (type == "point") {
      j.only({"type", "position", "power", "radius", "color", "camera_visible"});
      light.kind = Light::Kind::Point;
      light.position = vector_of(j.at("position").numbers<3>(-kFar, kFar));
      const auto radius = j.find("radius");
      if (radius && !(radius->json().is_number() && radius->json().get<double>() == 0))
        light.radius = radius->number(kSmall, kFar);
      resolved["radius"] = light.radius;
      light.intensity = color * (j.at("power").number(0, kBright) / (4 * kPi));
      if (light.radius > 0) light.radiance = light.intensity / (kPi * sqr(light.radius));
    } else {
      j.only({"type", "position", "direction", "up", "size", "power", "color", "camera_visible"});
      light.position = vector_of(j.at("position").numbers<3>(-kFar, kFar));
      light.direction = read_direction(j.at("direction"));
      Vector up{0, 0, 1};
      if (const auto v = j.find("up"))
        up = vector_of(v->numbers<3>(-kFar, kFar));
      else if (length(cross(light.direction, up)) < 1e-6)
        up = {0, 1, 0};
      if (!(length(cross(light.direction, up)) > 1e-6 * length(up)))
        j.error("expected \"up\" not to be parallel to the direction");
      resolved["up"] = {up.x, up.y, up.z};
      const Vector v = normalize(up - light.direction * dot(up, light.direction)), u = cross(light.direction, v);
      const JsonView size = j.at("size");
      double area;
      if (type == "disk") {
        light.kind = Light::Kind::Disk;
        const double r = size.number(kSmall, kFar) / 2;
        light.u = u * r;
        light.v = v * r;
        area = kPi * r * r;
      } else {
        light.kind = Light::Kind::Rectangle;
        const auto s = size.json().is_number()
                           ? std::array<double, 2>{size.number(kSmall, kFar), size.number(kSmall, kFar)}
                           : size.numbers<2>(kSmall, kFar);
        resolved["size"] = s;
        light.u = u * (s[0] / 2);
        light.v = v * (s[1] / 2);
        area = s[0] * s[1];
      }
      light.radiance = color * (j.at("power").number(0, kBright) / (kPi * area));
    }
    scene_.resolved["lights"].push_back(std::move(resolved));
    if (max_component(light.radiance) > 0 || max_component(light.intensity) > 0)
      scene_.lights.push_back(std::move(light));
  }

  /// They stay what they are, as in Cycles.
  void note_negative(const Image& image, const std::string& name) {
    std::size_t count = 0, first = 0;
    float least = 0;
    for (std::size_t i = 0; i < image.rgb.size(); ++i)
      if (image.rgb[i] < 0) {
        if (count++ == 0) first = i / 3;
        least = std::min(least, image.rgb[i]);
      }
    if (count)
      note(fmt::format("{}: {} negative, the first at ({}, {}), the least {:g}; they take light away, as in Cycles",
                       name, count == 1 ? "1 value is" : fmt::format("{} values are", count), first % image.width,
                       first / image.width, least));
  }

  static Vector read_direction(const JsonView& j) {
    const Vector d = vector_of(j.numbers<3>(-kFar, kFar));
    if (!(length(d) > 1e-9)) j.fail("a direction that is not zero");
    return normalize(d);
  }

  void read_environment(const std::optional<JsonView>& j) {
    Environment& e = scene_.environment;
    json& resolved = scene_.resolved["environment"];
    const double strength = j && j->has("strength") ? j->at("strength").number(0, kBright) : 1;
    resolved["strength"] = strength;
    if (j && (j->has("image") || j->has("procedural"))) {
      Image image;
      if (j->has("image")) {
        j->only({"image", "colorspace", "strength"});
        image = read_picture(j->at("image"), read_colorspace(*j));
        note_negative(image, beside(j->at("image").text()).string());
      } else {
        j->only({"procedural", "width", "strength"});
        const std::string name = j->at("procedural").choice({"sky", "interior", "checker"});
        const auto width = j->find("width");
        image = procedural_environment(name, width ? width->integer(4, 16384) / 2 * 2 : 1024);
      }
      std::string name;
      e.image = keep(std::move(image), name);
      e.strength = strength;
      resolved["image"] = name;
      return;
    }
    if (j) {
      j->only({"color", "strength"});
      e.color = Rgb<double>(strength, strength, strength);
      if (const auto v = j->find("color")) {
        const auto c = v->numbers<3>(0, kBright);
        e.color = Rgb<double>(c[0], c[1], c[2]) * strength;
        resolved["color"] = c;
        return;
      }
      resolved["color"] = {1, 1, 1};
      return;
    }
    resolved["color"] = {0, 0, 0};
  }

  fs::path path_;
  json json_;
  bool materials_alone_ = false;
  std::optional<ColorConfig> with_working_space_;
  Scene scene_;
  std::map<std::string, Shape> shapes_;  // by their text
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
    out << scene.resolved.dump(2) << '\n';
    out.close();
    if (!out) input_error("{}: can't write", (folder / "scene.json").string());
  });
}

}  // namespace brdfc::reference
