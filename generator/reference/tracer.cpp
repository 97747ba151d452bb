// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/tracer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;

/// One division instead of three.
Vector unit(const Vector& v) { return v * (1 / sqrt(dot(v, v))); }

template <class A> Vector to_vector(const A& a) { return {a[0], a[1], a[2]}; }
std::array<float, 3> to_floats(const Vector& v) { return {float(v.x), float(v.y), float(v.z)}; }

constexpr std::size_t kPacket = 8;

void put(const Ray& from, RTCRay& to) {
  to.org_x = float(from.origin.x), to.org_y = float(from.origin.y), to.org_z = float(from.origin.z);
  to.dir_x = float(from.direction.x), to.dir_y = float(from.direction.y), to.dir_z = float(from.direction.z);
  to.tfar = float(from.distance);
  to.tnear = to.time = 0;
  to.mask = ~0u;
  to.id = to.flags = 0;
}
void put(const Ray& from, RTCRay8& to, std::size_t k) {
  to.org_x[k] = float(from.origin.x), to.org_y[k] = float(from.origin.y), to.org_z[k] = float(from.origin.z);
  to.dir_x[k] = float(from.direction.x), to.dir_y[k] = float(from.direction.y), to.dir_z[k] = float(from.direction.z);
  to.tfar[k] = float(from.distance);
  to.tnear[k] = to.time[k] = 0;
  to.mask[k] = ~0u;
  to.id[k] = to.flags[k] = 0;
}

/// Which rays of a packet count: the first `count`.
struct alignas(32) Valid {
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
    Part part{object.mesh.get(), {}, {}, {}, {}, object.material};
    for (const auto& v : object.mesh->vertices)
      part.vertices.push_back(to_floats(object.transform.point(to_vector(v))));
    for (const auto& n : object.mesh->normals) part.normals.push_back(to_floats(object.transform.normal(to_vector(n))));
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
      // Embree may read 16 bytes at the last vertex, hence its own buffer.
      auto* vertices = static_cast<float*>(
          rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, part.vertices.size()));
      auto* indices = static_cast<std::int32_t*>(rtcSetNewGeometryBuffer(
          geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, part.mesh->triangles.size()));
      if (!vertices || !indices) throw std::bad_alloc();
      std::copy_n(part.vertices.front().data(), 3 * part.vertices.size(), vertices);
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
    RTCRayHit8 query;
    for (std::size_t k = 0; k < kPacket; ++k) {
      put(rays[i + std::min(k, count - 1)], query.ray, k);
      query.hit.geomID[k] = query.hit.primID[k] = query.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
    }
    rtcIntersect8(valid.lanes, scene, &context, &query);
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
    RTCRay8 query;
    for (std::size_t k = 0; k < kPacket; ++k) put(rays[i + std::min(k, count - 1)], query, k);
    rtcOccluded8(valid.lanes, scene_, &context, &query);
    for (std::size_t k = 0; k < count; ++k) hidden[i + k] = query.tfar[k] < 0;
  }
}

bool Tracer::intersect(const Ray& ray, bool from_camera, Hit& hit) const {
  Meeting meeting;
  intersect({&ray, 1}, from_camera, {&meeting, 1});
  return at(ray, meeting, hit);
}

bool Tracer::occluded(const Ray& ray) const {
  std::uint8_t hidden;
  occluded({&ray, 1}, {&hidden, 1});
  return hidden;
}

bool Tracer::at(const Ray& ray, const Meeting& meeting, Hit& hit) const {
  if (meeting.part == RTC_INVALID_GEOMETRY_ID) return false;
  const Part& part = parts_[meeting.part];
  const auto& triangle = part.mesh->triangles[meeting.triangle];
  const Vector a = to_vector(part.vertices[triangle[0]]), b = to_vector(part.vertices[triangle[1]]),
               c = to_vector(part.vertices[triangle[2]]);
  const double wb = meeting.u, wc = meeting.v, wa = 1 - wb - wc;
  hit.material = part.material;
  // From the corners, not along the ray: so that the point is in the plane of the triangle.
  hit.p = a * wa + b * wb + c * wc;
  hit.distance = length(hit.p - ray.origin);
  hit.geometric = unit(cross(b - a, c - a));
  hit.normal = hit.geometric;
  if (!part.normals.empty())
    hit.normal = unit(to_vector(part.normals[triangle[0]]) * wa + to_vector(part.normals[triangle[1]]) * wb +
                      to_vector(part.normals[triangle[2]]) * wc);
  if (!part.mesh->uvs.empty()) {
    const auto &ua = part.mesh->uvs[triangle[0]], &ub = part.mesh->uvs[triangle[1]], &uc = part.mesh->uvs[triangle[2]];
    hit.u = ua[0] * wa + ub[0] * wb + uc[0] * wc;
    hit.v = ua[1] * wa + ub[1] * wb + uc[1] * wc;
  } else {
    hit.u = hit.v = 0;
  }
  hit.inside = dot(hit.geometric, ray.direction) > 0;
  if (hit.inside) {
    hit.geometric = -hit.geometric;
    hit.normal = -hit.normal;
  }
  Vector tangent = part.z_axis - hit.normal * dot(part.z_axis, hit.normal);
  if (dot(tangent, tangent) < 1e-8) tangent = part.x_axis - hit.normal * dot(part.x_axis, hit.normal);
  hit.tangent = unit(tangent);
  return true;
}

Sphere Tracer::bounds() const {
  RTCBounds b;
  rtcGetSceneBounds(camera_scene_, &b);
  const Vector low{b.lower_x, b.lower_y, b.lower_z}, high{b.upper_x, b.upper_y, b.upper_z};
  return {(low + high) * 0.5, length(high - low) * (0.5 * (1 + 1e-6))};
}

}  // namespace brdfc::reference
