// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles of a scene behind Embree.
//
// Objects of equal meshes share them where copies would take much memory; otherwise each object has a copy of its own
// in world space, which rays pass sooner. A shared mesh lies in object space, behind a user geometry that turns rays
// into it: Embree's own instances do so in single precision, whose error exceeds the step that leave() takes.
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
  double distance = kInfinity;     ///< what lies further away does not count
};

/// Where a ray ends: a triangle and weights of its second and third corner.
struct Meeting {
  std::uint32_t part, triangle;
  float u, v;
};

/// A point on a surface as seen along a ray. Unit vectors, both normals on the viewer's side.
struct Point {
  Vec3<double> p;
  Vec3<double> geometric, normal, tangent;
  double distance = kInfinity;
  bool inside = false;  ///< seen from behind: the object's own normal points away from the viewer
};
struct Hit : Point {
  double u = 0, v = 0;  ///< texture coordinates
  int material = 0;
};

/// The points of a block.
struct Hits {
  Vectors p, geometric, normal, tangent;
  Numbers distance;
  Numbers side;  ///< -1 inside, else 1
};

class Tracer {
 public:
  /// `most_copies`: objects share meshes where these would have more copies of triangles. `memory`: bytes that Embree
  /// may take. Throws std::bad_alloc if the scene needs more.
  explicit Tracer(const Scene& scene, std::size_t most_copies = kMostCopies, std::size_t memory = available_memory());
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// What each ray meets first. Rays are traced in packets, which change nothing of what is found.
  void intersect(std::span<const Ray> rays, bool from_camera, std::span<Meeting> meetings) const;
  /// Of what a ray meets, or -1 if that is nothing.
  int material(const Meeting& meeting) const {
    return meeting.part == RTC_INVALID_GEOMETRY_ID ? -1 : parts_[meeting.part].material;
  }
  /// The points of meetings, all of which there are, as many as fill whole vectors.
  void at(const Rays& rays, const Lanes<Meeting>& meetings, std::size_t count, Hits& hits) const;
  /// Texture coordinates there.
  std::array<double, 2> texture_place(const Meeting& meeting) const;
  /// For each ray whether it meets anything.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden) const;
  /// The same for one ray alone.
  bool intersect(const Ray& ray, bool from_camera, Hit& hit) const;
  bool occluded(const Ray& ray) const;
  /// Bytes that Embree has taken.
  std::size_t memory() const { return std::size_t(taken_.load()); }
  /// A sphere that holds all triangles.
  Sphere bounds() const;
  /// `p` moved off its surface by a few units in the last place of float, to the side of `direction`.
  static Vec3<double> leave(const Vec3<double>& p, const Vec3<double>& geometric, const Vec3<double>& direction) {
    // Eight units in the last place of the largest coordinate cover the rounding of the corners and of the origin.
    const double step = maximum(maximum(abs(p.x), abs(p.y)), maximum(abs(p.z), 1e-3)) * 0x1p-20;
    return p + geometric * (dot(geometric, direction) > 0 ? step : -step);
  }

 private:
  /// In world space, as Embree sees it. What is read together lies together.
  struct Corner {
    std::array<float, 3> p, normal{};
    std::array<float, 2> uv{};
  };
  struct Part {
    const Mesh* mesh;
    std::vector<Corner> corners;  // empty where the mesh is shared
    Vec3<double> x_axis, z_axis;
    int material;
    // Of a shared mesh: its triangles in object space, and the way into it.
    RTCScene shape = nullptr;
    const Transform* transform = nullptr;
    std::array<Vec3<double>, 3> inverse{};  // rows
  };

  /// What a point is made of.
  struct Place {
    std::array<Vec3<double>, 3> corners, normals;  // no normals: the triangle's own
    Vec3<double> x_axis, z_axis;
    double u, v;
  };
  static Point point(const Place& place, const Vec3<double>& origin, const Vec3<double>& direction);
  static Corner corner(const Mesh& mesh, std::size_t vertex, const Transform& transform);
  /// `made` has room for those that are not kept.
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

  /// Of a user geometry, which is a Part with a shared mesh.
  static void bounds_of_part(const RTCBoundsFunctionArguments* arguments);
  static void intersect_part(const RTCIntersectFunctionNArguments* arguments);
  static void occluded_part(const RTCOccludedFunctionNArguments* arguments);
  /// Ray k of a packet of `count`, in the object space of the part.
  static Ray into(const Part& part, RTCRayN* rays, unsigned count, unsigned k);

  /// Committed, with the geometries that `fill` attaches.
  template <class Fill> RTCScene build(const Fill& fill);
  /// Triangles between vertices that `set_vertices` gives to the geometry.
  template <class SetVertices>
  void attach_triangles(RTCScene scene, unsigned id, const Mesh& mesh, const SetVertices& set_vertices) const;
  /// A mesh in object space.
  RTCScene shape(const Mesh& mesh);
  static bool take_memory(void* tracer, ssize_t bytes, bool after);
  void release();

  RTCDevice device_ = nullptr;
  RTCScene camera_scene_ = nullptr, scene_ = nullptr;  // equal unless an object is for the camera only
  std::vector<Part> parts_;
  std::map<const Mesh*, RTCScene> shapes_;  // of meshes that are shared
  const std::size_t memory_;
  std::atomic<std::ptrdiff_t> taken_{0};  // bytes, by Embree
};

}  // namespace brdfc::reference
