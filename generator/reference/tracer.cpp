// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/tracer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "reference/cone.h"

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;

template <class A> Vector to_vector(const A& a) { return {a[0], a[1], a[2]}; }
std::array<float, 3> to_floats(const Vector& v) { return {float(v.x), float(v.y), float(v.z)}; }

constexpr std::size_t kPacket = 16;

void put(const Ray& from, RTCRay& to) {
  to.org_x = float(from.origin.x), to.org_y = float(from.origin.y), to.org_z = float(from.origin.z);
  to.dir_x = float(from.direction.x), to.dir_y = float(from.direction.y), to.dir_z = float(from.direction.z);
  to.tfar = float(from.distance);
  to.tnear = to.time = 0;
  to.mask = ~0u;
  to.id = to.flags = 0;
}
void put(const Ray& from, RTCRay16& to, std::size_t k) {
  to.org_x[k] = float(from.origin.x), to.org_y[k] = float(from.origin.y), to.org_z[k] = float(from.origin.z);
  to.dir_x[k] = float(from.direction.x), to.dir_y[k] = float(from.direction.y), to.dir_z[k] = float(from.direction.z);
  to.tfar[k] = float(from.distance);
  to.tnear[k] = to.time[k] = 0;
  to.mask[k] = ~0u;
  to.id[k] = to.flags[k] = 0;
}

/// Which rays of a packet count: the first `count`.
struct alignas(64) Valid {
  int lanes[kPacket];
  explicit Valid(std::size_t count) {
    for (std::size_t k = 0; k < kPacket; ++k) lanes[k] = k < count ? -1 : 0;
  }
};

}  // namespace

Tracer::Tracer(const Scene& scene) {
  device_ = rtcNewDevice(nullptr);
  if (!device_) throw std::runtime_error("Embree can't start on this machine");
  parts_.reserve(scene.objects.size());
  for (const Object& object : scene.objects) {
    const Mesh& mesh = *object.mesh;
    Part part{&mesh, std::vector<Corner>(mesh.vertices.size()), {}, {}, object.material};
    for (std::size_t i = 0; i < part.corners.size(); ++i) {
      Corner& corner = part.corners[i];
      corner.p = to_floats(object.transform.point(to_vector(mesh.vertices[i])));
      if (!mesh.normals.empty()) corner.normal = to_floats(object.transform.normal(to_vector(mesh.normals[i])));
      if (!mesh.uvs.empty()) corner.uv = mesh.uvs[i];
    }
    part.x_axis = normalize(object.transform.vector({1, 0, 0}));
    part.z_axis = normalize(object.transform.vector({0, 0, 1}));
    parts_.push_back(std::move(part));
  }
  const auto build = [&](bool for_camera) {
    RTCScene out = rtcNewScene(device_);
    rtcSetSceneFlags(out, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(out, RTC_BUILD_QUALITY_HIGH);
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (scene.objects[i].camera_only && !for_camera) continue;
      const Part& part = parts_[i];
      RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      // Embree may read 16 bytes at a vertex, which a corner has, and at the last triangle.
      rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, part.corners.data(), 0,
                                 sizeof(Corner), part.corners.size());
      auto* indices = static_cast<std::int32_t*>(rtcSetNewGeometryBuffer(
          geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, part.mesh->triangles.size()));
      if (!indices) throw std::bad_alloc();
      std::copy_n(part.mesh->triangles.front().data(), 3 * part.mesh->triangles.size(), indices);
      rtcCommitGeometry(geometry);
      rtcAttachGeometryByID(out, geometry, unsigned(i));
      rtcReleaseGeometry(geometry);
    }
    rtcCommitScene(out);
    return out;
  };
  camera_scene_ = build(true);
  const bool split =
      std::any_of(scene.objects.begin(), scene.objects.end(), [](const Object& o) { return o.camera_only; });
  scene_ = split ? build(false) : camera_scene_;
  if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("Embree could not build the scene");
}

Tracer::~Tracer() {
  if (scene_ && scene_ != camera_scene_) rtcReleaseScene(scene_);
  if (camera_scene_) rtcReleaseScene(camera_scene_);
  if (device_) rtcReleaseDevice(device_);
}

void Tracer::intersect(std::span<const Ray> rays, bool from_camera, std::span<Meeting> meetings) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (from_camera) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  const RTCScene scene = from_camera ? camera_scene_ : scene_;
  for (std::size_t i = 0; i < rays.size(); i += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - i);
    if (count == 1) {
      RTCRayHit query;
      put(rays[i], query.ray);
      query.hit.geomID = query.hit.primID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene, &context, &query);
      meetings[i] = {query.hit.geomID, query.hit.primID, query.hit.u, query.hit.v};
      break;
    }
    const Valid valid(count);
    RTCRayHit16 query;
    for (std::size_t k = 0; k < kPacket; ++k) {
      put(rays[i + std::min(k, count - 1)], query.ray, k);
      query.hit.geomID[k] = query.hit.primID[k] = query.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect16(valid.lanes, scene, &context, &query);
    for (std::size_t k = 0; k < count; ++k)
      meetings[i + k] = {query.hit.geomID[k], query.hit.primID[k], query.hit.u[k], query.hit.v[k]};
  }
}

void Tracer::occluded(std::span<const Ray> rays, std::span<std::uint8_t> hidden) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (std::size_t i = 0; i < rays.size(); i += kPacket) {
    const std::size_t count = std::min(kPacket, rays.size() - i);
    if (count == 1) {
      RTCRay query;
      put(rays[i], query);
      rtcOccluded1(scene_, &context, &query);
      hidden[i] = query.tfar < 0;
      break;
    }
    const Valid valid(count);
    RTCRay16 query;
    for (std::size_t k = 0; k < kPacket; ++k) put(rays[i + std::min(k, count - 1)], query, k);
    rtcOccluded16(valid.lanes, scene_, &context, &query);
    for (std::size_t k = 0; k < count; ++k) hidden[i + k] = query.tfar[k] < 0;
  }
}

bool Tracer::intersect(const Ray& ray, bool from_camera, Hit& hit) const {
  Meeting meeting;
  intersect({&ray, 1}, from_camera, {&meeting, 1});
  if (material(meeting) < 0) return false;
  const Part& part = parts_[meeting.part];
  const auto [a, b, c] = corners(meeting);
  static_cast<Point&>(hit) = point({{to_vector(a->p), to_vector(b->p), to_vector(c->p)},
                                    {to_vector(a->normal), to_vector(b->normal), to_vector(c->normal)},
                                    part.x_axis,
                                    part.z_axis,
                                    meeting.u,
                                    meeting.v},
                                   ray.origin, ray.direction);
  const auto [u, v] = texture_place(meeting);
  hit.u = u, hit.v = v;
  hit.material = part.material;
  return true;
}

bool Tracer::occluded(const Ray& ray) const {
  std::uint8_t hidden;
  occluded({&ray, 1}, {&hidden, 1});
  return hidden;
}

std::array<double, 2> Tracer::texture_place(const Meeting& meeting) const {
  const auto [a, b, c] = corners(meeting);
  const double wb = meeting.u, wc = meeting.v, wa = 1 - wb - wc;
  return {a->uv[0] * wa + b->uv[0] * wb + c->uv[0] * wc, a->uv[1] * wa + b->uv[1] * wb + c->uv[1] * wc};
}

inline Point Tracer::point(const Place& place, const Vector& origin, const Vector& direction) {
  const auto& [a, b, c] = place.corners;
  const auto& [na, nb, nc] = place.normals;
  const double wb = place.u, wc = place.v, wa = 1 - wb - wc;
  Point out;
  // From the corners, not along the ray: so that the point is in the plane of the triangle.
  out.p = a * wa + b * wb + c * wc;
  out.distance = length(out.p - origin);
  const Vector geometric = unit(cross(b - a, c - a)), normal = na * wa + nb * wb + nc * wc;
  out.inside = dot(geometric, direction) > 0;
  const double side = out.inside ? -1 : 1;
  out.geometric = geometric * side;
  out.normal = select(dot(normal, normal) > 0, unit(normal), geometric) * side;
  const Vector tangent = place.z_axis - out.normal * dot(place.z_axis, out.normal),
               other = place.x_axis - out.normal * dot(place.x_axis, out.normal);
  out.tangent = unit(select(dot(tangent, tangent) < 1e-8, other, tangent));
  return out;
}

BRDFC_VECTORISED void Tracer::at(const Rays& rays, const Lanes<Meeting>& meetings, std::size_t count,
                                 Hits& hits) const {
  struct {
    std::array<VectorsOf<float>, 3> corners, normals;
    Vectors x_axis, z_axis;
    Lanes<float> u, v;
  } places;
  for (std::size_t k = 0; k < lanes_for(count); ++k) {
    const Meeting& m = meetings[k];
    const auto from = corners(m);
    for (std::size_t i = 0; i < 3; ++i) {
      places.corners[i].set(k, from[i]->p);
      places.normals[i].set(k, from[i]->normal);
    }
    places.x_axis.set(k, parts_[m.part].x_axis);
    places.z_axis.set(k, parts_[m.part].z_axis);
    places.u[k] = m.u;
    places.v[k] = m.v;
  }
  for_lanes(count, [&](std::size_t k) {
    const auto& [a, b, c] = places.corners;
    const auto& [na, nb, nc] = places.normals;
    const Point p =
        point({{a[k], b[k], c[k]}, {na[k], nb[k], nc[k]}, places.x_axis[k], places.z_axis[k], places.u[k], places.v[k]},
              rays.origin[k], rays.direction[k]);
    hits.p.set(k, p.p);
    hits.geometric.set(k, p.geometric);
    hits.normal.set(k, p.normal);
    hits.tangent.set(k, p.tangent);
    hits.distance[k] = p.distance;
    hits.side[k] = p.inside ? -1 : 1;
  });
}

Sphere Tracer::bounds() const {
  RTCBounds b;
  rtcGetSceneBounds(camera_scene_, &b);
  const Vector low{b.lower_x, b.lower_y, b.lower_z}, high{b.upper_x, b.upper_y, b.upper_z};
  return {(low + high) * 0.5, length(high - low) * (0.5 * (1 + 1e-6))};
}

}  // namespace brdfc::reference
