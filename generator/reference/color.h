// SPDX-License-Identifier: GPL-3.0-or-later
// Colour spaces and view transforms, by OpenColorIO.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "model/optical.h"
#include "model/spectrum.h"
#include "reference/image.h"

namespace brdfc::reference {

/// The x and y of red, green, blue and white, in the order of EXR files.
using Chromaticities = std::array<float, 8>;

/// A linear space that a file can state for its colours.
struct LinearSpace {
  const char* interop_id;  ///< identifier of the Color Interop Forum
  Chromaticities chromaticities;
};
const std::vector<LinearSpace>& linear_spaces();

/// A working space that a scene can ask for by name.
struct WorkingSpace {
  const char* name;        ///< name in Blender and its configurations
  const char* interop_id;  ///< identifier in EXR files, which Blender writes from 5.0 on
  Chromaticities chromaticities;
};
const std::array<WorkingSpace, 3>& working_spaces();

/// An OpenColorIO configuration. Its role "scene_linear" is the working space, in which renderers compute.
class ColorConfig {
 public:
  /// Throws InputError that names the file, and also its version if that is too new for this OpenColorIO.
  explicit ColorConfig(const std::filesystem::path& file);
  ColorConfig(ColorConfig&&) noexcept;
  ~ColorConfig();

  /// The configuration that the environment variable OCIO names, as for every program that uses OpenColorIO, including
  /// Blender; "ocio://NAME" names one that OpenColorIO 2.2 and later contain. Without the variable it is
  /// data/color/config.ocio. That file also replaces a configuration of a later version, with a message on stderr.
  /// Loaded once.
  /// Throws as the constructor.
  static const ColorConfig& current();

  /// The same configuration with another working space: one of working_spaces(), also by the names that ACES
  /// configurations have for it, or any space by name, alias or role. Throws InputError that lists them.
  ColorConfig with_working_space(const std::string&) const;
  /// The name of the working space.
  std::string working_space() const;

  const std::filesystem::path& file() const { return file_; }
  /// Names of the colour spaces, and of the view transforms of the default display.
  std::vector<std::string> spaces() const;
  std::vector<std::string> views() const;
  /// The view "Standard" if it exists, else the default view of the default display.
  std::string standard_view() const;
  /// True if there is a space with that name, alias or role.
  bool has_space(const std::string&) const;

  /// Converts pixels from a colour space, given by name, alias or role, to scene-linear. Spaces for data are left
  /// unchanged. Throws InputError that lists the spaces if none has that name.
  void to_scene_linear(Image& image, const std::string& space) const;
  /// Converts pixels from sRGB to scene-linear, also in configurations without a space of that name.
  void srgb_to_scene_linear(Image& image) const;
  /// Converts linear pixels with these primaries to scene-linear, adapted to the white of the working space (Bradford).
  /// Pixels that are in the working space already are left unchanged. CIE XYZ, whose white is the equal-energy white,
  /// is not adapted. Throws InputError as from_xyz().
  void to_scene_linear(Image& image, const Chromaticities&) const;
  /// The scene-linear colour for X, Y and Z relative to a perfect reflector, whose colour is 1, 1, 1. Throws InputError
  /// if the configuration has no role aces_interchange, which relates its spaces to measurable quantities.
  std::array<double, 3> from_xyz(const Xyz&) const;
  /// from_xyz() of this configuration with linear Rec.709 as its working space.
  ToRgb to_rec709() const;
  /// Converts scene-linear pixels to those of the default display, in [0, 1], through `view`, or through
  /// standard_view() if that is empty. Throws InputError that lists the views.
  void to_display(Image& image, const std::string& view) const;

 private:
  struct Impl;
  ColorConfig(std::filesystem::path file, std::unique_ptr<Impl>);
  std::string interchange() const;

  std::filesystem::path file_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace brdfc::reference
