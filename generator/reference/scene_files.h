// SPDX-License-Identifier: GPL-3.0-or-later
// Context for the readers of a scene file's parts: the scene that they fill, the files that the scene names, and notes
// about these.
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

/// A scene that is being read.
class SceneFiles {
 public:
  /// `path` is the scene file. The other files are relative to its folder.
  explicit SceneFiles(const std::filesystem::path& path) : path_(path) {}

  Scene scene;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path beside(const std::string& name) const;

  /// Calls read(path) for the file that a key names. If the file can't be used, the error names the key.
  template <class Read> auto read_file(const JsonView& where, Read read) const
      -> decltype(read(std::filesystem::path())) {
    const std::filesystem::path file = beside(where.text());
    try {
      return read(file);
    } catch (const InputError& e) {
      where.error(e.what());
    }
  }

  /// Sets the working space that the scene asks for.
  void read_working_space(const JsonView&);
  const ColorConfig& colors() const { return with_working_space_ ? *with_working_space_ : ColorConfig::current(); }

  /// Adds a note, unless it was added before.
  void note(const std::string& text);

  /// Reads an image, whose file has the colour space `space`, and converts it to the working space.
  Image read_picture(const JsonView&, const std::string& space);
  /// The value of an image's "colorspace"; "auto" if it has none.
  std::string read_colorspace(const JsonView&) const;
  /// Stores one copy of each image and mesh. `name`, and the stem of the mesh's files, are derived from the content.
  std::shared_ptr<const Image> keep(Image image, std::string& name);
  std::shared_ptr<const Mesh> keep(Mesh mesh, std::string& stem);

 private:
  std::filesystem::path path_;
  std::optional<ColorConfig> with_working_space_;
};

/// A hash of a text, as 16 hexadecimal digits.
std::string short_hash(const std::string& text);

/// Reads the key "materials". `alone`: in a file for load_materials().
void read_materials(const JsonView&, SceneFiles&, bool alone);
/// Reads "objects". The scene's materials must have been read.
void read_objects(const JsonView&, SceneFiles&);
/// Reads one of "lights".
void read_light(const JsonView&, SceneFiles&);
/// Reads "environment", which is optional.
void read_environment(const std::optional<JsonView>&, SceneFiles&);

}  // namespace brdfc::reference
