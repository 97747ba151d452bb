// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes as both renderers see them. The file format is described in scenes/schema.json.
//
// Lengths are in scene units, z is up, angles in degrees. Lights have Blender's units and conventions, measured
// with a white Lambert plane in Cycles:
//   point  power P: intensity P / (4 pi), that is, radiance P / (4 pi^2 r^2) for a sphere of radius r > 0
//   sun    irradiance E on a surface that faces it, whatever its angular diameter
//   area   power P: radiance P / (pi A), one-sided, for the rectangle and the disk
// Lamps are invisible to the camera unless "camera_visible" says otherwise; they block no light.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "core/vec.h"
#include "model/model.h"
#include "reference/image.h"
#include "reference/mesh.h"
#include "reference/patterns.h"

namespace brdfc::reference {

/// Which samples are taken of light that does not come from a mirror; all give the same mean.
enum class Strategy {
  Mis,    ///< both, weighted by the power heuristic
  Brdf,   ///< the BRDF's directions alone (and lamps that no ray can meet)
  Light,  ///< the lights' directions alone
};

/// As scene files and the command line spell them, in the order of Strategy.
const std::vector<std::string>& strategy_names();
/// The strategy of one of them.
Strategy strategy_named(const std::string& name);

struct RenderSettings {
  int width = 256, height = 256;
  int spp = 64;
  int seed = 0;
  /// Scatterings after the first: 0 is direct light alone, as in Cycles.
  int max_bounces = 8;
  /// Radiance changes with the squared index where it is refracted, as in nature; Cycles leaves it as it is.
  bool scale_radiance = false;
  /// Of the samples of a pixel; the variance layer then states more noise than there is.
  Pattern pattern = Pattern::Random;
  Strategy strategy = Strategy::Mis;  ///< of paths from the camera
};

struct Camera {
  bool orthographic = false;
  Vec3<double> position, right, up, forward;  ///< orthonormal
  double half_height = 1;  ///< perspective: tangent of half the vertical angle; orthographic: scene units
};

struct Material {
  std::string id;
  const Model* model = nullptr;
  ParamValues values;  ///< complete; for a textured parameter the mean of its texture
  std::map<std::string, std::shared_ptr<const Image>> textures;
  std::set<std::string> varying;  ///< parameters that something not known here sets; only from load_materials()
  std::string representation = "auto";
};

/// world = matrix * object + translation
struct Transform {
  std::array<std::array<double, 3>, 3> matrix{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vec3<double> translation;

  Vec3<double> vector(const Vec3<double>& v) const;
  Vec3<double> point(const Vec3<double>& p) const { return vector(p) + translation; }
  /// Direction of a normal: by the inverse transpose.
  Vec3<double> normal(const Vec3<double>& n) const;
};

struct Object {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Transform transform;
  int material = 0;
  bool camera_only = false;  ///< unseen by all rays but those from the camera; casts no shadow
};

struct Light {
  enum class Kind { Point, Sun, Rectangle, Disk };
  Kind kind = Kind::Point;
  std::string key;         ///< place in the file, for messages
  Vec3<double> position;   ///< centre
  Vec3<double> direction;  ///< in which it shines; unit length
  Vec3<double> u, v;       ///< area: half axes
  double radius = 0;       ///< point: of the sphere; sun: sine of half the angular diameter
  Rgb<double> radiance;    ///< of what has an extent
  Rgb<double> intensity;   ///< point of radius 0: W/sr; sun of angle 0: W/m^2 facing it
  bool camera_visible = false;
};

struct Environment {
  Rgb<double> color{0, 0, 0};          ///< constant radiance, if there is no image
  std::shared_ptr<const Image> image;  ///< equirectangular, bilinear
  double strength = 1;                 ///< factor on the image

  Rgb<double> radiance(const Vec3<double>& direction) const;
  /// At a place of the image, as direction_to_equirectangular() gives it.
  Rgb<double> radiance(double u, double v) const {
    return bilinear(*image, u, v, Wrap::Repeat, Wrap::Clamp) * strength;
  }
};

struct Scene {
  std::string name, description;
  std::string working_space;  ///< of working_spaces(), by name, if the file asks for one
  RenderSettings settings;
  Camera camera;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<Light> lights;
  Environment environment;

  /// What was assumed or left out of its files, and how many triangles each mesh file has: lines for people.
  std::vector<std::string> notes;

  /// The same scene with every default written out and meshes and images named by their content.
  nlohmann::json resolved;
  std::map<std::string, std::shared_ptr<const Mesh>> mesh_files;    ///< by the stem of their names
  std::map<std::string, std::shared_ptr<const Image>> image_files;  ///< by file name
  /// 16 hexadecimal digits: equal for scenes that look the same at equal settings.
  std::string hash;
};

/// Triangles that renderers may copy because objects share a mesh: a quarter of a gigabyte.
inline constexpr std::size_t kMostCopies = std::size_t(1) << 21;

/// Lamps up to which each of them is weighed wherever one is chosen; of more a tree chooses.
inline constexpr std::size_t kMostWeighed = 8;

/// Throws InputError naming the file, the key and what was expected.
Scene load_scene(const std::filesystem::path& path);

/// What a .blend uses.
struct UsedMaterials {
  std::vector<Material> materials;
  std::vector<std::string> sizeless_lamps;  ///< names of lamps that are points, or suns without an angle
  std::optional<int> lamps;                 ///< how many there are to aim at, if the file says so
};
/// A file that has nothing but the schema's "materials", with {"varies": true} in place of the value of a parameter
/// that is not constant, "sizeless_lamps", a list of names, if there are any, and "lamps", how many there are. Throws
/// as load_scene().
UsedMaterials load_materials(const std::filesystem::path& path);

/// Writes scene.json, the meshes as .npy and the images as .exr into the folder, scene.json last.
void write_resolved(const Scene& scene, const std::filesystem::path& folder);

}  // namespace brdfc::reference
