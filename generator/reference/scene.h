// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes, as both renderers read them. scenes/schema.json describes the file format.
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
#include "measured/sum_model.h"
#include "model/model.h"
#include "reference/image.h"
#include "reference/mesh.h"
#include "reference/patterns.h"

namespace brdfc::reference {

/// Sampling techniques for light that does not come from a mirror. All give the same mean.
enum class Strategy {
  Mis,    ///< both techniques, combined by the power heuristic
  Brdf,   ///< BRDF sampling alone (and lamps that rays can't meet)
  Light,  ///< light sampling alone
};

/// The names in scene files and on the command line, in the order of Strategy.
const std::vector<std::string>& strategy_names();
/// The strategy with one of strategy_names().
Strategy strategy_named(const std::string& name);

struct RenderSettings {
  int width = 256, height = 256;
  int spp = 64;
  int seed = 0;
  /// Scattering events after the first: 0 is direct light only, as in Cycles.
  int max_bounces = 8;
  /// Scale radiance by the squared index at refraction, as is physically correct. Cycles does not scale it.
  bool scale_radiance = false;
  /// Pattern of a pixel's samples. With a pattern other than Random, the variance layer overestimates the noise.
  Pattern pattern = Pattern::Random;
  Strategy strategy = Strategy::Mis;  ///< for paths from the camera
};

struct Camera {
  bool orthographic = false;
  Vec3<double> position, right, up, forward;  ///< orthonormal
  double half_height = 1;  ///< perspective: tangent of half the vertical angle; orthographic: scene units
};

struct Material {
  std::string id;
  const Model* model = nullptr;
  ParamValues values;  ///< a value for every parameter; for a textured one the mean of its texture
  std::map<std::string, std::shared_ptr<const Image>> textures;
  std::set<std::string> varying;  ///< parameters whose values vary and are not known here; only from load_materials()
  std::string representation = "auto";
  /// Owns `model` if that is not a registered one: it looks measured data up, or adds `sum` up.
  std::shared_ptr<const Model> own;
  /// The lobes of a sum or of layers, whose colours and numbers are constant; empty for other materials.
  std::vector<measured::Lobe> sum;
  measured::Stack stack = measured::Stack::Sum;
};

/// Throws InputError naming the first material that no other renderer has: measured data as such, or layers of which an
/// upper one is of a model whose albedo no table holds.
void require_models(const std::vector<Material>&);

/// world = matrix * object + translation
struct Transform {
  std::array<std::array<double, 3>, 3> matrix{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vec3<double> translation;

  Vec3<double> vector(const Vec3<double>& v) const;
  Vec3<double> point(const Vec3<double>& p) const { return vector(p) + translation; }
  /// Transforms the direction of a normal, by the inverse transpose.
  Vec3<double> normal(const Vec3<double>& n) const;
};

struct Object {
  std::string name;
  std::shared_ptr<const Mesh> mesh;
  Transform transform;
  int material = 0;
  bool camera_only = false;  ///< visible to camera rays only; casts no shadow
};

struct Light {
  enum class Kind { Point, Sun, Rectangle, Disk };
  Kind kind = Kind::Point;
  std::string key;         ///< place in the file, for messages
  Vec3<double> position;   ///< centre
  Vec3<double> direction;  ///< in which it emits; unit length
  Vec3<double> u, v;       ///< area: half axes
  double radius = 0;       ///< point: radius of the sphere; sun: sine of half the angular diameter
  Rgb<double> radiance;    ///< for lights with a size
  Rgb<double> intensity;   ///< point of radius 0: W/sr; sun of angle 0: W/m^2 facing it
  bool camera_visible = false;
};

struct Environment {
  Rgb<double> color{0, 0, 0};          ///< constant radiance, if there is no image
  std::shared_ptr<const Image> image;  ///< equirectangular, bilinear
  double strength = 1;                 ///< factor on the image

  Rgb<double> radiance(const Vec3<double>& direction) const;
  /// Radiance at a place of the image, as in direction_to_equirectangular().
  Rgb<double> radiance(double u, double v) const {
    return bilinear(*image, u, v, Wrap::Repeat, Wrap::Clamp) * strength;
  }
};

struct Scene {
  std::string name, description;
  std::string working_space;  ///< name of one of working_spaces(), if the file asks for one
  RenderSettings settings;
  Camera camera;
  std::vector<Material> materials;
  std::vector<Object> objects;
  std::vector<Light> lights;
  Environment environment;

  /// Lines for people: what was assumed or left out of files, and the number of triangles in each mesh file.
  std::vector<std::string> notes;

  /// The scene with every default written out, and with meshes and images named by their content.
  nlohmann::json resolved;
  std::map<std::string, std::shared_ptr<const Mesh>> mesh_files;    ///< by the stem of the file name
  std::map<std::string, std::shared_ptr<const Image>> image_files;  ///< by file name
  /// 16 hexadecimal digits. Equal for scenes that look the same at equal settings.
  std::string hash;
};

/// Limit for triangles that renderers may copy if objects share a mesh: a quarter of a gigabyte.
inline constexpr std::size_t kMostCopies = std::size_t(1) << 21;

/// Number of lamps up to which each gets a weight whenever a lamp is chosen. With more lamps a light tree chooses.
inline constexpr std::size_t kMostWeighed = 8;

/// Reads a scene. Throws InputError that names the file, the key and what was expected.
Scene load_scene(const std::filesystem::path& path);

/// The models and lamps that a .blend uses.
struct UsedMaterials {
  std::vector<Material> materials;
  std::vector<std::string> sizeless_lamps;  ///< points and spots without a radius, suns without an angle
  std::optional<int> lamps;                 ///< number of lamps to aim at, if the file gives it
};
/// Reads a file of materials alone: "materials" as in the schema, with {"varies": true} as the value of a parameter
/// that is not constant; "sizeless_lamps", a list of names, if there are any; and "lamps", the number of lamps to aim
/// at. Throws as load_scene().
UsedMaterials load_materials(const std::filesystem::path& path);

/// Writes the resolved scene into a folder: the meshes as .npy, the images as .exr, and scene.json last.
void write_resolved(const Scene& scene, const std::filesystem::path& folder);

}  // namespace brdfc::reference
