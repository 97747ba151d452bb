// SPDX-License-Identifier: GPL-3.0-or-later
// Environments and textures that this project's own code generates. No third-party art is used.
#pragma once

#include "core/vectorised.h"
#include "reference/image.h"

namespace brdfc::reference {

/// Blender's equirectangular convention, seen from inside. u = 1/2 - atan2(y, x) / (2 pi): +x is the middle of the
/// picture, and +y is a quarter of the width to the left. v = atan2(z, hypot(x, y)) / pi + 1/2.
inline void direction_to_equirectangular(const Vec3<double>& d, double& u, double& v) {
  u = 0.5 - vectorised::atan2(d.y, d.x) / (2 * kPi);
  v = vectorised::atan2(d.z, sqrt(d.x * d.x + d.y * d.y)) / kPi + 0.5;
}
Vec3<double> equirectangular_to_direction(double u, double v);

/// The environment with this name, "sky", "interior" or "checker", as an equirectangular picture of `width` x `width /
/// 2`, with 16 samples per texel.
Image procedural_environment(const std::string& name, int width);

/// A checkerboard of two colours, with `cells` along each side of the unit square of uv and 16 texels per cell.
Image checker_texture(const Rgb<double>& a, const Rgb<double>& b, int cells);

}  // namespace brdfc::reference
