// SPDX-License-Identifier: GPL-3.0-or-later
// Readers for shapes that a few numbers describe: the keys of each shape, with their ranges and defaults.
#pragma once

#include <string>
#include <vector>

#include "reference/json_view.h"
#include "reference/mesh.h"

namespace brdfc::reference {

inline constexpr double kFar = 1e6;     ///< largest coordinate or length in a scene file
inline constexpr double kSmall = 1e-6;  ///< smallest length that is not zero

/// The values that "type" of a shape may have, except for meshes from files.
std::vector<std::string> shape_types();

/// Makes the shape that the object `j` describes. Its "type" is one of shape_types(). Throws InputError that names file
/// and key.
Mesh read_shape_of_numbers(const JsonView& j, const std::string& type);

/// The radius of a sphere.
double read_radius(const JsonView& j);
/// The sphere with a radius of 1 in place of its own.
Mesh read_unit_sphere(const JsonView& j);

}  // namespace brdfc::reference
