// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes for the shapes that a scene file describes by a few numbers, from a quad to half a million triangles. The same
// numbers give the same triangles on every machine.
#pragma once

#include <array>

#include "reference/mesh.h"

namespace brdfc::reference {

/// A latitude-longitude sphere about the origin, with its poles on the z axis. u runs once around, from +x towards +y;
/// v runs from the lower pole to the upper.
Mesh make_sphere(double radius, int segments, int rings, bool smooth);
/// A rectangle in the xy plane about the origin. The front faces +z; u runs along x, v along y.
Mesh make_quad(double width, double height);
/// A disk in the xy plane about the origin. The front faces +z; uv is (1/2, 1/2) at the centre.
Mesh make_disk(double radius, int segments);
/// A box about the origin with flat faces. Each face has the whole unit square as uv.
Mesh make_box(const std::array<double, 3>& size);
/// A cylinder about the z axis, from -height/2 to height/2, with both ends closed. u runs once around, from +x towards
/// +y; v runs upwards. `smooth` makes the sides round; the ends are flat.
Mesh make_cylinder(double radius, double height, int segments, bool smooth);
/// A tube along the torus knot that goes `p` times around the z axis and `q` times around the ring. The ring has radius
/// 1, the winding 0.4 and the tube `tube`. The tube has `ripples` rings along it, a quarter of `tube` high. Smooth; 2
/// segments * sides triangles. `p` and `q` must have no common divisor.
Mesh make_knot(int p, int q, double tube, int ripples, int segments, int sides);
/// A floor of count * count tiles of side 1 about the origin, with its front towards +z. Each tile has its own waves,
/// with root mean square height `relief` and no shorter than half a tile, and slopes down to a joint over a width of
/// `joint`, to a depth of a quarter of that. `resolution` is the number of quads along a tile's side, `seed` selects
/// the waves. uv is the unit square over the whole floor.
Mesh make_tiles(int count, double relief, double joint, int resolution, int seed);

}  // namespace brdfc::reference
