// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/views.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "model/horizon.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;

/// Triangles are subdivided until the cones that contain their directions are narrower than kFine radians, at most
/// kHalvings times.
constexpr double kFine = 0.003;
constexpr int kHalvings = 20;
/// Error margins of single precision: of positions, and of cosines.
constexpr double kRounding = 1e-6, kSlack = 1e-5;
/// Number of pixels beyond the picture's edge that a pixel filter may reach.
constexpr double kBorder = 2;
/// A scene is tested for convexity only if it has no more pairs of a triangle and a vertex than this.
constexpr std::size_t kPairs = 20'000'000;

struct TriangleCorner {
  Vector p, normal;
};
using Corners = std::array<TriangleCorner, 3>;

Vector to_vector(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }
TriangleCorner middle(const TriangleCorner& a, const TriangleCorner& b) {
  return {(a.p + b.p) * 0.5, (a.normal + b.normal) * 0.5};
}
double angle_between(const Vector& a, const Vector& b) { return std::acos(std::clamp(dot(a, b), -1.0, 1.0)); }

struct Cone {
  Vector axis;
  double angle;
};
/// A cone that contains all directions between the three vectors, whatever their lengths. Cones are convex if their
/// half-angle is less than a right angle; otherwise the cone contains all directions.
Cone cone(const Vector& a, const Vector& b, const Vector& c) {
  Cone out{{0, 0, 1}, 0};
  const std::array<Vector, 3> unit = {normalize(a), normalize(b), normalize(c)};
  out.axis = normalize(unit[0] + unit[1] + unit[2]);
  for (const Vector& v : unit) out.angle = std::max(out.angle, angle_between(out.axis, v));
  const bool narrow = out.angle < kPi / 2 && length(out.axis) > 0;  // false for NaN
  return narrow ? out : Cone{{0, 0, 1}, kPi};
}

/// The directions and distances from points to the camera.
class Viewer {
 public:
  Viewer(const Camera& camera, const RenderSettings& settings)
      : camera_(camera), edge_y_(camera.half_height * (1 + 2 * kBorder / settings.height)) {
    edge_x_ = camera.half_height * (settings.width + 2 * kBorder) / settings.height;
  }

  Vector from(const Vector& p) const { return camera_.orthographic ? -camera_.forward : camera_.position - p; }
  double depth(const Vector& p) const { return dot(p - camera_.position, camera_.forward); }
  /// True if the triangle is entirely beyond one edge of the picture, or behind the camera.
  bool out_of_sight(const Corners& c) const {
    const auto all = [&](const auto& beyond) { return beyond(c[0].p) && beyond(c[1].p) && beyond(c[2].p); };
    const auto beyond = [&](const Vector& side, double edge) {
      return all([&](const Vector& p) {
        return dot(p - camera_.position, side) > edge * (camera_.orthographic ? 1 : depth(p));
      });
    };
    return all([&](const Vector& p) { return depth(p) < 0; }) || beyond(camera_.right, edge_x_) ||
           beyond(-camera_.right, edge_x_) || beyond(camera_.up, edge_y_) || beyond(-camera_.up, edge_y_);
  }
  Cone cone(const Corners& c) const {
    if (camera_.orthographic) return {-camera_.forward, 0};
    return reference::cone(from(c[0].p), from(c[1].p), from(c[2].p));
  }
  bool orthographic() const { return camera_.orthographic; }

 private:
  const Camera& camera_;
  double edge_x_ = 0, edge_y_;
};

/// Calls each(corners, twice the area along the normal) for every triangle of an object in scene coordinates.
template <class Each> void for_triangles(const Object& object, const Each& each) {
  const Mesh& mesh = *object.mesh;
  for (const auto& triangle : mesh.triangles) {
    Corners c;
    for (std::size_t i = 0; i < 3; ++i)
      c[i].p = object.transform.point(to_vector(mesh.vertices[std::size_t(triangle[i])]));
    const Vector area = cross(c[1].p - c[0].p, c[2].p - c[0].p);
    if (!(length(area) > 0)) continue;
    for (std::size_t i = 0; i < 3; ++i)
      c[i].normal =
          mesh.normals.empty() ? area : object.transform.normal(to_vector(mesh.normals[std::size_t(triangle[i])]));
    each(c, area);
  }
}

/// Adds the cosines at which a triangle is seen to `seen`. `front` and `back` are the sides that may face the viewer.
void add_seen(Cosines& seen, const Viewer& viewer, const Corners& c, bool front, bool back, int halvings) {
  if (viewer.out_of_sight(c)) return;
  const Cone to_viewer = viewer.cone(c), normals = cone(c[0].normal, c[1].normal, c[2].normal);
  const double angle = angle_between(to_viewer.axis, normals.axis), spread = to_viewer.angle + normals.angle;
  Cosines here{1, 0};
  const auto add = [&](double a) {
    const double nearest = std::cos(std::max(a - spread, 0.0)), farthest = std::cos(std::min(a + spread, kPi));
    here.add({std::max(farthest, 0.0), std::max(nearest, kMinCosTheta)});
  };
  if (front) add(angle);
  if (back) add(kPi - angle);
  if (seen.has(here)) return;
  if (spread < kFine || halvings == 0) {
    seen.add(here);
    return;
  }
  const TriangleCorner ab = middle(c[0], c[1]), bc = middle(c[1], c[2]), ca = middle(c[2], c[0]);
  for (const Corners& part : {Corners{c[0], ab, ca}, Corners{ab, c[1], bc}, Corners{ca, bc, c[2]}, Corners{ab, bc, ca}})
    add_seen(seen, viewer, part, front, back, halvings - 1);
}

/// True if the triangles of a mesh enclose a volume: each edge of a triangle belongs to exactly one other, in the
/// opposite direction.
bool closed(const Mesh& mesh) {
  using Place = std::array<float, 3>;
  std::map<std::pair<Place, Place>, int> edges;
  for (const auto& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Place &a = mesh.vertices[std::size_t(triangle[i])], &b = mesh.vertices[std::size_t(triangle[(i + 1) % 3])];
      if (a == b) continue;
      ++edges[{a, b}];
      --edges[{b, a}];
    }
  return std::ranges::all_of(edges, [](const auto& edge) { return edge.second == 0; });
}

/// True if the camera sees only sides of triangles that have nothing in front of them.
bool nothing_in_front(const Scene& scene, const Viewer& viewer) {
  std::vector<Vector> places;
  std::size_t triangles = 0;
  double largest = 0;
  for (const Object& o : scene.objects) {
    triangles += o.mesh->triangles.size();
    for (const auto& v : o.mesh->vertices) {
      const Vector p = places.emplace_back(o.transform.point(to_vector(v)));
      largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
      if (viewer.orthographic() && !(viewer.depth(p) > 0)) return false;
    }
  }
  if (triangles * places.size() > kPairs) return false;
  for (const Object& o : scene.objects) {
    bool faces_viewer = false, hides = false, good = true;
    for_triangles(o, [&](const Corners& c, const Vector& area) {
      const Vector normal = normalize(area) * (dot(area, viewer.from(c[0].p)) > 0 ? 1.0 : -1.0);
      bool before = false, behind = false;
      for (const Vector& p : places) {
        const double height = dot(p - c[0].p, normal);
        before = before || height > kRounding * largest;
        behind = behind || height < -kRounding * largest;
      }
      good = good && !(before && behind);
      hides = hides || before;
      faces_viewer = faces_viewer || !before;
    });
    // A convex body seen from outside hides the inner sides of its own triangles.
    if (!good || (hides && !(faces_viewer && closed(*o.mesh)))) return false;
  }
  return true;
}

}  // namespace

std::vector<Cosines> seen_cosines(const Scene& scene) {
  std::vector<Cosines> out(scene.materials.size());
  const Viewer viewer(scene.camera, scene.settings);
  if (std::ranges::any_of(scene.materials, [](const Material& m) { return m.model->two_sided(); })) return out;
  if (scene.settings.max_bounces > 0 && !nothing_in_front(scene, viewer)) return out;
  for (std::size_t m = 0; m < out.size(); ++m) {
    Cosines seen{1, 0};
    for (const Object& o : scene.objects) {
      if (std::size_t(o.material) != m) continue;
      for_triangles(o, [&](const Corners& c, const Vector& area) {
        const Vector to_viewer = viewer.from(c[0].p);
        const double side = dot(area, to_viewer), little = kRounding * length(area) * length(to_viewer);
        add_seen(seen, viewer, c, side > -little, side < little, kHalvings);
      });
    }
    if (seen.low <= seen.high) out[m] = {std::max(seen.low - kSlack, 0.0), std::min(seen.high + kSlack, 1.0)};
  }
  return out;
}

}  // namespace brdfc::reference
