// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes as meshes: what a scene file names by a few numbers, from a quad to half a million triangles. The same numbers
// give the same triangles on every machine.
#pragma once

#include <array>

#include "reference/mesh.h"

namespace brdfc::reference {

/// Latitude-longitude sphere about the origin, poles on z; u runs once around from +x towards +y, v from the
/// lower pole to the upper.
Mesh make_sphere(double radius, int segments, int rings, bool smooth);
/// Rectangle in the xy plane about the origin, front towards +z, u along x, v along y.
Mesh make_quad(double width, double height);
/// Disk in the xy plane about the origin, front towards +z; uv (1/2, 1/2) at the centre.
Mesh make_disk(double radius, int segments);
/// Box about the origin with flat faces; each face has the whole unit square as uv.
Mesh make_box(const std::array<double, 3>& size);
/// Cylinder about the z axis, from -height/2 to height/2, with both ends closed; u runs once around from +x towards +y,
/// v upwards. `smooth`: round sides; the ends are flat.
Mesh make_cylinder(double radius, double height, int segments, bool smooth);
/// A tube along the torus knot that goes `p` times around the z axis and `q` times around the ring: the ring's radius
/// is 1, the winding's 0.4, the tube's `tube`, with `ripples` rings along it that are a quarter of that high. Smooth;
/// 2 segments * sides triangles. `p` and `q` have no common divisor.
Mesh make_knot(int p, int q, double tube, int ripples, int segments, int sides);
/// A floor of count * count tiles of side 1 about the origin, front towards +z. Each is curved by waves of its own,
/// `relief` high as a root mean square and no shorter than half a tile, and falls off to a joint over a width of
/// `joint`, a quarter as deep. `resolution`: quads along a tile's side. `seed`: other waves. uv is the unit square over
/// the whole floor.
Mesh make_tiles(int count, double relief, double joint, int resolution, int seed);

}  // namespace brdfc::reference
