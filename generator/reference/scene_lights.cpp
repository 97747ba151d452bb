// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the lamps and the environment of a scene file.
#include <algorithm>
#include <cmath>

#include "reference/procedural.h"
#include "reference/scene_files.h"
#include "reference/shape_reader.h"

namespace brdfc::reference {

using nlohmann::json;

namespace {

Vec3<double> read_direction(const JsonView& j) {
  const Vec3<double> d = vector_of(j.numbers<3>(-kFar, kFar));
  if (!(length(d) > 1e-9)) j.fail("a direction that is not zero");
  return normalize(d);
}

/// Notes negative values, which are kept, as in Cycles.
void note_negative(SceneFiles& files, const Image& image, const std::string& name) {
  std::size_t count = 0, first = 0;
  float least = 0;
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    if (image.rgb[i] < 0) {
      if (count++ == 0) first = i / 3;
      least = std::min(least, image.rgb[i]);
    }
  if (count)
    files.note(fmt::format("{}: {} negative, the first at ({}, {}), the least {:g}; they take light away, as in Cycles",
                           name, count == 1 ? "1 value is" : fmt::format("{} values are", count), first % image.width,
                           first / image.width, least));
}

/// Turns an equirectangular picture about z, counterclockwise seen from above, by whole texels.
void turn(Image& image, double degrees) {
  const double turns = degrees / 360 - std::floor(degrees / 360);
  const auto shift = std::lround(turns * image.width) % image.width;
  for (int y = 0; y < image.height; ++y)
    std::rotate(image.pixel(0, y), image.pixel(0, y) + 3 * shift, image.pixel(0, y) + 3 * image.width);
}

}  // namespace

void read_light(const JsonView& j, SceneFiles& files) {
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
    Vec3<double> up{0, 0, 1};
    if (const auto v = j.find("up"))
      up = vector_of(v->numbers<3>(-kFar, kFar));
    else if (length(cross(light.direction, up)) < 1e-6)
      up = {0, 1, 0};
    if (!(length(cross(light.direction, up)) > 1e-6 * length(up)))
      j.error("expected \"up\" not to be parallel to the direction");
    resolved["up"] = {up.x, up.y, up.z};
    const Vec3<double> v = normalize(up - light.direction * dot(up, light.direction)), u = cross(light.direction, v);
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
  files.scene.resolved["lights"].push_back(std::move(resolved));
  if (max_component(light.radiance) > 0 || max_component(light.intensity) > 0)
    files.scene.lights.push_back(std::move(light));
}

void read_environment(const std::optional<JsonView>& j, SceneFiles& files) {
  Environment& e = files.scene.environment;
  json& resolved = files.scene.resolved["environment"];
  const double strength = j && j->has("strength") ? j->at("strength").number(0, kBright) : 1;
  resolved["strength"] = strength;
  if (j && (j->has("image") || j->has("procedural"))) {
    Image image;
    if (j->has("image")) {
      j->only({"image", "colorspace", "rotate_degrees", "strength"});
      image = files.read_picture(j->at("image"), files.read_colorspace(*j));
      note_negative(files, image, files.beside(j->at("image").text()).string());
    } else {
      j->only({"procedural", "width", "rotate_degrees", "strength"});
      const std::string name = j->at("procedural").choice({"sky", "interior", "checker"});
      const auto width = j->find("width");
      image = procedural_environment(name, width ? width->integer(4, 16384) / 2 * 2 : 1024);
    }
    if (const auto v = j->find("rotate_degrees")) turn(image, v->number(-3600, 3600));
    std::string name;
    e.image = files.keep(std::move(image), name);
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

}  // namespace brdfc::reference
