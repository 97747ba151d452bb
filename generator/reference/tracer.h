// SPDX-License-Identifier: GPL-3.0-or-later
// Ray intersection: the triangles of a scene in Embree.
//
// Objects with equal meshes share one copy if separate copies would take much memory. Otherwise each object has its own
// copy in world space, which is faster to intersect. A shared mesh is in object space, behind a user geometry that
// transforms rays into it. Embree's own instances transform rays in single precision, with an error larger than the
// step of leave().
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "core/process.h"
#include "reference/block.h"
#include "reference/lights.h"
#include "reference/scene.h"

namespace brdfc::reference {

struct Sphere {
  Vec3<double> centre;
  double radius = 0;
};

struct Ray {
  Vec3<double> origin, direction;  ///< direction is a unit vector
  double distance = kInfinity;     ///< anything further away is ignored
};

/// An intersection: a triangle, and the weights of its second and third corner.
struct Meeting {
  std::uint32_t part, triangle;
  float u, v;
};

/// A point on a surface, as seen along a ray. The vectors have unit length, and both normals are on the viewer's side.
struct Point {
  Vec3<double> p;
  Vec3<double> geometric, normal, tangent;
  double distance = kInfinity;
  bool inside = false;  ///< seen from behind, so that the object's own normal points away from the viewer
};
struct Hit : Point {
  double u = 0, v = 0;  ///< texture coordinates
  int material = 0;
};

/// The points for a block of rays.
struct Hits {
  Vectors p, geometric, normal, tangent;
  Numbers distance;
  Numbers side;  ///< -1 for points seen from inside, else 1
};

class Tracer {
 public:
  /// `most_copies`: objects share meshes if separate copies would have more triangles than this. `memory`: bytes that
  /// Embree may allocate. Throws std::bad_alloc if the scene needs more.
  explicit Tracer(const Scene& scene, std::size_t most_copies = kMostCopies, std::size_t memory = available_memory());
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// The first intersection of each ray. Rays are traced in packets, which does not change the results.
  void intersect(std::span<const Ray> rays, bool from_camera, std::span<Meeting> meetings) const;
  /// The material at an intersection; -1 if there is none.
  int material(const Meeting& meeting) const {
    return meeting.part == RTC_INVALID_GEOMETRY_ID ? -1 : parts_[meeting.part].material;
  }
  /// Computes the points at intersections, for `count` rounded up to whole vectors. All of these intersections must
  /// exist.
  void at(const Rays& rays, const Lanes<Meeting>& meetings, std::size_t count, Hits& hits) const;
  /// Texture coordinates at an intersection.
  std::array<double, 2> texture_place(const Meeting& meeting) const;
  /// For each ray, whether it is blocked.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden) const;
  /// The same for a single ray.
  bool intersect(const Ray& ray, bool from_camera, Hit& hit) const;
  bool occluded(const Ray& ray) const;
  /// Bytes that Embree has allocated.
  std::size_t memory() const { return std::size_t(taken_.load()); }
  /// A sphere that contains all triangles.
  Sphere bounds() const;
  /// Moves `p` off its surface by a few units in the last place of float, to the side of `direction`.
  static Vec3<double> leave(const Vec3<double>& p, const Vec3<double>& geometric, const Vec3<double>& direction) {
    // Eight units in the last place of the largest coordinate cover the rounding of the corners and of the origin.
    const double step = maximum(maximum(abs(p.x), abs(p.y)), maximum(abs(p.z), 1e-3)) * 0x1p-20;
    return p + geometric * (dot(geometric, direction) > 0 ? step : -step);
  }

 private:
  /// A vertex in world space, as Embree gets it. Data that are read together are stored together.
  struct Corner {
    std::array<float, 3> p, normal{};
    std::array<float, 2> uv{};
  };
  struct Part {
    const Mesh* mesh;
    std::vector<Corner> corners;  // empty if the mesh is shared
    Vec3<double> x_axis, z_axis;
    int material;
    // For a shared mesh: its triangles in object space, and the transform into it.
    RTCScene shape = nullptr;
    const Transform* transform = nullptr;
    std::array<Vec3<double>, 3> inverse{};  // rows
  };

  /// The data from which a point is computed.
  struct Place {
    std::array<Vec3<double>, 3> corners, normals;  // zero normals: use the triangle's own
    Vec3<double> x_axis, z_axis;
    double u, v;
  };
  static Point point(const Place& place, const Vec3<double>& origin, const Vec3<double>& direction);
  static Corner corner(const Mesh& mesh, std::size_t vertex, const Transform& transform);
  /// `made` provides storage for corners that are not stored.
  std::array<const Corner*, 3> corners(const Meeting& meeting, std::array<Corner, 3>& made) const {
    const Part& part = parts_[meeting.part];
    const auto& triangle = part.mesh->triangles[meeting.triangle];
    if (part.shape) {
      for (std::size_t i = 0; i < 3; ++i) made[i] = corner(*part.mesh, std::size_t(triangle[i]), *part.transform);
      return {&made[0], &made[1], &made[2]};
    }
    return {&part.corners[std::size_t(triangle[0])], &part.corners[std::size_t(triangle[1])],
            &part.corners[std::size_t(triangle[2])]};
  }

  /// Embree callbacks of a user geometry, which is a Part with a shared mesh.
  static void bounds_of_part(const RTCBoundsFunctionArguments* arguments);
  static void intersect_part(const RTCIntersectFunctionNArguments* arguments);
  static void occluded_part(const RTCOccludedFunctionNArguments* arguments);
  /// Ray k of a packet of `count`, transformed into the object space of the part.
  static Ray into(const Part& part, RTCRayN* rays, unsigned count, unsigned k);

  /// Makes a scene with the geometries that `fill` attaches, and commits it.
  template <class Fill> RTCScene build(const Fill& fill);
  /// Attaches the triangles of a mesh. `set_vertices` provides the vertices of the geometry.
  template <class SetVertices>
  void attach_triangles(RTCScene scene, unsigned id, const Mesh& mesh, const SetVertices& set_vertices) const;
  /// The Embree scene of a mesh in object space.
  RTCScene shape(const Mesh& mesh);
  static bool take_memory(void* tracer, ssize_t bytes, bool after);
  void release();

  RTCDevice device_ = nullptr;
  RTCScene camera_scene_ = nullptr, scene_ = nullptr;  // identical unless an object is visible to the camera only
  std::vector<Part> parts_;
  std::map<const Mesh*, RTCScene> shapes_;  // for shared meshes
  const std::size_t memory_;
  std::atomic<std::ptrdiff_t> taken_{0};  // bytes that Embree has allocated
};

}  // namespace brdfc::reference
