// SPDX-License-Identifier: GPL-3.0-or-later
// What the parts of a scene file are read with: the scene that they fill, the files that they name, and what is said of
// these.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "reference/color.h"
#include "reference/json_view.h"
#include "reference/scene.h"

namespace brdfc::reference {

inline constexpr double kBright = 1e9;  ///< largest power, irradiance or radiance in a scene file

inline Vec3<double> vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

/// A scene while its file is read.
class SceneFiles {
 public:
  /// `path`: of the scene file, beside which the others are.
  explicit SceneFiles(const std::filesystem::path& path) : path_(path) {}

  Scene scene;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path beside(const std::string& name) const;

  /// What read(path) gives of the file that a key names. One that can't be used is reported with the key.
  template <class Read> auto read_file(const JsonView& where, Read read) const
      -> decltype(read(std::filesystem::path())) {
    const std::filesystem::path file = beside(where.text());
    try {
      return read(file);
    } catch (const InputError& e) {
      where.error(e.what());
    }
  }

  /// Takes the working space that the scene asks for.
  void read_working_space(const JsonView&);
  const ColorConfig& colors() const { return with_working_space_ ? *with_working_space_ : ColorConfig::current(); }

  /// Says something once.
  void note(const std::string& text);

  /// An image in the working space, of a file in this space.
  Image read_picture(const JsonView&, const std::string& space);
  /// What an image's "colorspace" says, "auto" without it.
  std::string read_colorspace(const JsonView&) const;
  /// One copy of each image and mesh; `name`, and the stem of the mesh's files, are by their content.
  std::shared_ptr<const Image> keep(Image image, std::string& name);
  std::shared_ptr<const Mesh> keep(Mesh mesh, std::string& stem);

 private:
  std::filesystem::path path_;
  std::optional<ColorConfig> with_working_space_;
};

/// Sixteen hexadecimal digits of a text.
std::string short_hash(const std::string& text);

/// What the key "materials" says. `alone`: in a file as load_materials() reads it.
void read_materials(const JsonView&, SceneFiles&, bool alone);
/// The same of "objects", of a scene that has its materials.
void read_objects(const JsonView&, SceneFiles&);
/// One of "lights".
void read_light(const JsonView&, SceneFiles&);
/// "environment", which a scene may lack.
void read_environment(const std::optional<JsonView>&, SceneFiles&);

}  // namespace brdfc::reference
