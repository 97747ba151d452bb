// SPDX-License-Identifier: GPL-3.0-or-later
// Pictures: float EXR files with layers and metadata, error measures, previews.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/vec.h"

namespace brdfc::reference {

class ColorConfig;

/// Linear RGB pixels. Row 0 is the top row. rgb.size() == 3 * width * height.
struct Image {
  int width = 0, height = 0;
  std::vector<float> rgb;

  Image() = default;
  Image(int w, int h) : width(w), height(h), rgb(std::size_t(3) * w * h, 0.0f) {}
  float* pixel(int x, int y) { return &rgb[3 * (std::size_t(y) * width + x)]; }
  const float* pixel(int x, int y) const { return &rgb[3 * (std::size_t(y) * width + x)]; }
  Rgb<double> color(int x, int y) const {
    const float* p = pixel(x, y);
    return {p[0], p[1], p[2]};
  }
};

/// The output of a renderer: radiance and, if known, the variance of each pixel's mean.
struct Rendering {
  Image mean;
  std::optional<Image> variance;
  /// Name of one of working_spaces(); empty for that of ColorConfig::current().
  std::string working_space;
  /// A flat object of strings and numbers, stored as EXR attributes "brdfc:<key>".
  nlohmann::json metadata = nlohmann::json::object();
};

/// The file's extension in lower case, with its dot.
std::string ending(const std::filesystem::path& path);

/// Reads a rendering: the channels R, G, B, without a layer or of the first layer that has them, such as Blender's
/// "Combined"; the channels "variance.R/G/B" if present; and the working space, if the attribute colorInteropID or,
/// without it, the attribute chromaticities gives it. Throws InputError that names the file, also if the attribute
/// gives a space that is not among working_spaces(), or if the file has integers, which are encoded for a display.
Rendering read_rendering(const std::filesystem::path& path);
/// Writes a float EXR with the variance as layer "variance". The metadata and, if set, the working space are
/// attributes.
void write_rendering(const std::filesystem::path& path, const Rendering& rendering);

/// Converts a rendering to the working space of another one, if they differ. The variance is dropped then, because it
/// does not include the covariances of the channels. Throws InputError if the configuration has no such space.
void to_working_space_of(Rendering& rendering, const Rendering& other);

/// Reads an image for use as texture or environment, as scene-linear colours. Grey images get three equal channels.
/// `space` is "linear" (as stored), "srgb", a colour space of the configuration by name, alias or role, or "auto".
/// "auto" means sRGB for integer pixels; for floating-point pixels it means the primaries that the file states, or
/// linear if it states none. A pixel that is not finite becomes black, as in Cycles, and a line about it is added to
/// `notes`. Throws InputError that names the file.
Image read_image(const std::filesystem::path& path, const ColorConfig&, const std::string& space = "auto",
                 std::vector<std::string>* notes = nullptr);
/// Writes a float EXR without metadata, so that equal pixels give equal files.
void write_image(const std::filesystem::path& path, const Image& image);

/// Error of `a` against the reference `b`, over all pixels and the three channels.
struct Comparison {
  double rel_mse = 0;  ///< mean of (a - b)^2 / (b^2 + 0.01)
  double mse = 0;      ///< mean of (a - b)^2
  double mean_a = 0, mean_b = 0;
  double bias = 0;  ///< mean_a - mean_b
  double max = 0;   ///< largest |a - b|
  int max_x = 0, max_y = 0;
  std::optional<double> noise_mse;  ///< part of mse that the variance layers explain; only if both have one
};

/// Throws InputError if the sizes differ or a pixel is not finite. `name_a` and `name_b` are for the message.
Comparison compare(const Rendering& a, const Rendering& b, const std::string& name_a = "A",
                   const std::string& name_b = "B");
nlohmann::json to_json(const Comparison& c);

/// A display-referred picture of the difference a - b in luminance, relative to `b`: red where a is brighter and blue
/// where it is darker. The colour is saturated at a difference of `scale` times the mean of b.
Image difference_image(const Image& a, const Image& b, double scale = 0.25);

/// Writes an 8-bit picture. Colours are multiplied by 2^exposure and converted by a view transform of
/// ColorConfig::current(), or by its standard_view() if `view` is empty.
void write_preview(const std::filesystem::path& path, const Rendering& rendering, double exposure = 0,
                   const std::string& view = "");
/// Writes an 8-bit picture of values that are already display-referred, in [0, 1].
void write_display(const std::filesystem::path& path, const Image& display);

enum class Wrap { Repeat, Clamp };

/// Bilinear interpolation at (u, v). v points upwards from the bottom edge, and texel centres are at (i + 1/2) / size,
/// as in Blender.
Rgb<double> bilinear(const Image& image, double u, double v, Wrap horizontal, Wrap vertical);

}  // namespace brdfc::reference
