// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes of a scene file that a few numbers describe: the keys of each, their ranges and defaults.
#pragma once

#include <string>
#include <vector>

#include "reference/json_view.h"
#include "reference/mesh.h"

namespace brdfc::reference {

inline constexpr double kFar = 1e6;     ///< largest coordinate or length in a scene file
inline constexpr double kSmall = 1e-6;  ///< smallest length that is not zero

/// What "type" of a shape may be, but for meshes that come from files.
std::vector<std::string> shape_types();

/// The shape `j`, an object whose "type" is that one of shape_types(). Throws InputError naming file and key.
Mesh read_shape_of_numbers(const JsonView& j, const std::string& type);

}  // namespace brdfc::reference
