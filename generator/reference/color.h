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

/// x and y of red, green, blue and white, as EXR files have them.
using Chromaticities = std::array<float, 8>;

/// A linear space that a file can say its colours are in.
struct LinearSpace {
  const char* interop_id;  ///< of the Color Interop Forum
  Chromaticities chromaticities;
};
const std::vector<LinearSpace>& linear_spaces();

/// A space that a scene can name as the one it is computed in.
struct WorkingSpace {
  const char* name;        ///< as Blender and its configurations call it
  const char* interop_id;  ///< as EXR files say it, which Blender writes from 5.0 on
  Chromaticities chromaticities;
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
  /// them, "ocio://NAME" for those that OpenColorIO 2.2 and later bring; data/color/config.ocio without it, and, said
  /// on stderr, in place of one of a later version. Loaded once.
  /// Throws as the constructor.
  static const ColorConfig& current();

  /// The same with one of its spaces as the working space: one of working_spaces(), under the names that ACES
  /// configurations have for it as well, or any by name, alias or role. Throws InputError that lists them.
  ColorConfig with_working_space(const std::string&) const;
  /// Its name.
  std::string working_space() const;

  const std::filesystem::path& file() const { return file_; }
  /// Names of colour spaces, and of the default display's view transforms.
  std::vector<std::string> spaces() const;
  std::vector<std::string> views() const;
  /// The view "Standard" where there is one, else the default view of the default display.
  std::string standard_view() const;
  /// Whether there is a space of that name, alias or role.
  bool has_space(const std::string&) const;

  /// Pixels of that colour space, by name, alias or role, become scene-linear. Spaces that hold data stay as they are.
  /// Throws InputError that lists the spaces if there is none of that name.
  void to_scene_linear(Image& image, const std::string& space) const;
  /// Pixels of sRGB become scene-linear, in configurations that have no space of that name as well.
  void srgb_to_scene_linear(Image& image) const;
  /// Linear pixels with these primaries become scene-linear, adapted to the working space's white (Bradford); those
  /// that are in the working space already stay as they are. CIE XYZ, whose white is that of equal energy, is not
  /// adapted. Throws InputError as from_xyz().
  void to_scene_linear(Image& image, const Chromaticities&) const;
  /// Scene-linear colour of X, Y and Z over those of a perfect reflector, which becomes 1, 1, 1. Throws InputError if
  /// the configuration has no role aces_interchange, which relates its spaces to what can be measured.
  std::array<double, 3> from_xyz(const Xyz&) const;
  /// Scene-linear pixels as the default display shows them, in [0, 1]; without the name of a view through
  /// standard_view(). Throws InputError that lists the views.
  void to_display(Image& image, const std::string& view) const;

 private:
  struct Impl;
  ColorConfig(std::filesystem::path file, std::unique_ptr<Impl>);
  std::string interchange() const;

  std::filesystem::path file_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brdfc::reference
