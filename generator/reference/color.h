// SPDX-License-Identifier: GPL-3.0-or-later
// Colour spaces and view transforms, by OpenColorIO.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "model/spectrum.h"
#include "reference/image.h"

namespace brdfc::reference {

/// A space that a scene can name as the one it is computed in.
struct WorkingSpace {
  const char* name;                     ///< as Blender and its configurations call it
  const char* interop_id;               ///< as EXR files say it, which Blender writes from 5.0 on
  std::array<float, 8> chromaticities;  ///< x and y of red, green, blue and white, as in EXR files
};
const std::array<WorkingSpace, 3>& working_spaces();

/// An OpenColorIO configuration. Renderers compute in its role "scene_linear", the working space.
class ColorConfig {
 public:
  /// Throws InputError that names the file, and its version where that is later than this OpenColorIO reads.
  explicit ColorConfig(const std::filesystem::path& file);
  ColorConfig(ColorConfig&&) noexcept;
  ~ColorConfig();

  /// The one that the environment variable OCIO names, as for every program that uses OpenColorIO, Blender's own among
  /// them; data/color/config.ocio without it, and, said on stderr, in place of one of a later version. Loaded once.
  /// Throws as the constructor.
  static const ColorConfig& current();

  /// The same with one of its spaces, by name, as the working space. Throws InputError that lists them.
  ColorConfig with_working_space(const std::string&) const;
  /// Its name.
  std::string working_space() const;

  const std::filesystem::path& file() const { return file_; }
  /// Names of colour spaces, and of the default display's view transforms.
  std::vector<std::string> spaces() const;
  std::vector<std::string> views() const;

  /// Pixels of that colour space, by name, alias or role, become scene-linear. Spaces that hold data stay as they are.
  /// Throws InputError that lists the spaces if there is none of that name.
  void to_scene_linear(Image& image, const std::string& space) const;
  /// Scene-linear colour of X, Y and Z over those of a perfect reflector, which becomes 1, 1, 1. Throws InputError if
  /// the configuration has no role aces_interchange, which relates its spaces to what can be measured.
  std::array<double, 3> from_xyz(const Xyz&) const;
  /// Scene-linear pixels as the default display shows them, in [0, 1]. Throws InputError that lists the views.
  void to_display(Image& image, const std::string& view) const;

 private:
  struct Impl;
  ColorConfig(std::filesystem::path file, std::unique_ptr<Impl>);
  std::filesystem::path file_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brdfc::reference
