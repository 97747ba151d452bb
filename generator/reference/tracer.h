// SPDX-License-Identifier: GPL-3.0-or-later
// Triangles of a scene behind Embree.
#pragma once

#include <embree3/rtcore.h>

#include <algorithm>
#include <cstdint>
#include <span>

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
struct Hit {
  Vec3<double> p;
  Vec3<double> geometric, normal, tangent;
  double u = 0, v = 0;  ///< texture coordinates
  double distance = kInfinity;
  int material = 0;                     ///< path tracing: -1 where a ray leaves the scene
  std::array<double, 2> environment{};  ///< there: its place in the environment's image
  bool inside = false;                  ///< seen from behind: the object's own normal points away from the viewer
};

class Tracer {
 public:
  explicit Tracer(const Scene& scene);
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// What each ray meets first. Rays are traced in packets, which change nothing of what is found.
  void intersect(std::span<const Ray> rays, bool from_camera, std::span<Meeting> meetings) const;
  /// The point of a meeting, or false if there is none.
  bool at(const Ray& ray, const Meeting& meeting, Hit& hit) const;
  /// For each ray whether it meets anything.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden) const;
  /// The same for one ray alone.
  bool intersect(const Ray& ray, bool from_camera, Hit& hit) const;
  bool occluded(const Ray& ray) const;
  /// A sphere that holds all triangles.
  Sphere bounds() const;
  /// `p` moved off its surface by a few units in the last place of float, to the side of `direction`.
  static Vec3<double> leave(const Vec3<double>& p, const Vec3<double>& geometric, const Vec3<double>& direction) {
    // Eight units in the last place of the largest coordinate cover the rounding of the corners and of the origin.
    const double step = std::max({abs(p.x), abs(p.y), abs(p.z), 1e-3}) * 0x1p-20;
    return p + geometric * (dot(geometric, direction) > 0 ? step : -step);
  }

 private:
  struct Part {
    const Mesh* mesh;
    std::vector<std::array<float, 3>> vertices, normals;  // world space, as Embree sees them
    Vec3<double> x_axis, z_axis;
    int material;
  };

  RTCDevice device_ = nullptr;
  RTCScene camera_scene_ = nullptr, scene_ = nullptr;  // equal unless an object is for the camera only
  std::vector<Part> parts_;
};

}  // namespace brdfc::reference
