// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/tracer.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

#include "reference/cone.h"

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;

template <class A> Vector to_vector(const A& a) { return {a[0], a[1], a[2]}; }
std::array<float, 3> to_floats(const Vector& v) { return {float(v.x), float(v.y), float(v.z)}; }

constexpr std::size_t kPacket = 16;

/// Smallest number of triangles for which instances of a mesh share it; smaller meshes are cheap to copy.
constexpr std::size_t kLeastShared = 256;

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

/// The mask of active rays in a packet: the first `count`.
struct alignas(64) Valid {
  int lanes[kPacket];
  explicit Valid(std::size_t count) {
    for (std::size_t k = 0; k < kPacket; ++k) lanes[k] = k < count ? -1 : 0;
  }
};

/// The indices of the active lanes of a packet. The rest of the array repeats the last one.
struct Active {
  unsigned lanes[kPacket], count = 0;
  Active(const int* valid, unsigned all) {
    for (unsigned k = 0; k < all; ++k)
      if (valid[k]) lanes[count++] = k;
    for (unsigned k = count; k < kPacket; ++k) lanes[k] = count ? lanes[count - 1] : 0;
  }
};

}  // namespace

Tracer::Corner Tracer::corner(const Mesh& mesh, std::size_t vertex, const Transform& transform) {
  Corner corner;
  corner.p = to_floats(transform.point(to_vector(mesh.vertices[vertex])));
  if (!mesh.normals.empty()) corner.normal = to_floats(transform.normal(to_vector(mesh.normals[vertex])));
  if (!mesh.uvs.empty()) corner.uv = mesh.uvs[vertex];
  return corner;
}

bool Tracer::take_memory(void* of, ssize_t bytes, bool) {
  Tracer& tracer = *static_cast<Tracer*>(of);
  return (tracer.taken_ += bytes) <= std::ptrdiff_t(tracer.memory_) || bytes < 0;
}

template <class Fill> RTCScene Tracer::build(const Fill& fill) {
  RTCScene out = rtcNewScene(device_);
  rtcSetSceneFlags(out, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(out, RTC_BUILD_QUALITY_HIGH);
  fill(out);
  rtcCommitScene(out);
  return out;
}

template <class SetVertices>
void Tracer::attach_triangles(RTCScene scene, unsigned id, const Mesh& mesh, const SetVertices& set_vertices) const {
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  set_vertices(geometry);
  // The indices are copied, because Embree may read 16 bytes at the last triangle.
  if (void* indices =
          rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()))
    std::copy_n(mesh.triangles.front().data(), 3 * mesh.triangles.size(), static_cast<std::int32_t*>(indices));
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

RTCScene Tracer::shape(const Mesh& mesh) {
  RTCScene& out = shapes_[&mesh];
  if (!out)
    out = build([&](RTCScene scene) {
      attach_triangles(scene, 0, mesh, [&](RTCGeometry geometry) {
        if (void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                                     mesh.vertices.size()))
          std::copy_n(mesh.vertices.front().data(), 3 * mesh.vertices.size(), static_cast<float*>(vertices));
      });
    });
  return out;
}

Tracer::Tracer(const Scene& scene, std::size_t most_copies, std::size_t memory) : memory_(memory) {
  std::map<const Mesh*, std::size_t> users;
  for (const Object& object : scene.objects) ++users[object.mesh.get()];
  const auto copies = [&](const Mesh* mesh) { return (users[mesh] - 1) * mesh->triangles.size(); };
  std::size_t all_copies = 0;
  for (const auto& [mesh, count] : users) all_copies += copies(mesh);
  const auto is_shared = [&](const Mesh* mesh) {
    return all_copies > most_copies && copies(mesh) > 0 && mesh->triangles.size() >= kLeastShared;
  };

  device_ = rtcNewDevice(nullptr);
  if (!device_) throw std::runtime_error("Embree can't start on this machine");
  rtcSetDeviceMemoryMonitorFunction(device_, take_memory, this);
  try {
    parts_.reserve(scene.objects.size());
    for (const Object& object : scene.objects) {
      const Mesh& mesh = *object.mesh;
      Part part{&mesh, {}, {}, {}, object.material};
      const auto column = [&](std::size_t k) {
        const auto& m = object.transform.matrix;
        return Vector{m[0][k], m[1][k], m[2][k]};
      };
      const Vector a = column(0), b = column(1), c = column(2);
      const double determinant = dot(a, cross(b, c));
      if (is_shared(&mesh) && determinant != 0) {
        part.shape = shape(mesh);
        part.transform = &object.transform;
        part.inverse = {cross(b, c) / determinant, cross(c, a) / determinant, cross(a, b) / determinant};
      } else {
        part.corners.reserve(mesh.vertices.size());
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
          part.corners.push_back(corner(mesh, i, object.transform));
      }
      part.x_axis = normalize(object.transform.vector({1, 0, 0}));
      part.z_axis = normalize(object.transform.vector({0, 0, 1}));
      parts_.push_back(std::move(part));
    }
    const auto build_for = [&](bool camera) {
      return build([&](RTCScene out) {
        for (std::size_t i = 0; i < parts_.size(); ++i) {
          if (scene.objects[i].camera_only && !camera) continue;
          Part& part = parts_[i];
          if (part.shape) {
            RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
            rtcSetGeometryUserPrimitiveCount(geometry, 1);
            rtcSetGeometryUserData(geometry, &part);
            rtcSetGeometryBoundsFunction(geometry, bounds_of_part, nullptr);
            rtcSetGeometryIntersectFunction(geometry, intersect_part);
            rtcSetGeometryOccludedFunction(geometry, occluded_part);
            rtcCommitGeometry(geometry);
            rtcAttachGeometryByID(out, geometry, unsigned(i));
            rtcReleaseGeometry(geometry);
          } else {
            // Embree may read 16 bytes at a vertex; a corner is that large.
            attach_triangles(out, unsigned(i), *part.mesh, [&](RTCGeometry geometry) {
              rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, part.corners.data(), 0,
                                         sizeof(Corner), part.corners.size());
            });
          }
        }
      });
    };
    camera_scene_ = build_for(true);
    const bool split =
        std::any_of(scene.objects.begin(), scene.objects.end(), [](const Object& o) { return o.camera_only; });
    scene_ = split ? build_for(false) : camera_scene_;
    switch (rtcGetDeviceError(device_)) {
      case RTC_ERROR_NONE:
        break;
      case RTC_ERROR_OUT_OF_MEMORY:
        throw std::bad_alloc();
      default:
        throw std::runtime_error("Embree could not build the scene");
    }
  } catch (...) {
    release();
    throw;
  }
}

void Tracer::release() {
  if (scene_ && scene_ != camera_scene_) rtcReleaseScene(scene_);
  if (camera_scene_) rtcReleaseScene(camera_scene_);
  for (const auto& [mesh, shape] : shapes_) rtcReleaseScene(shape);
  if (device_) rtcReleaseDevice(device_);
}

Tracer::~Tracer() { release(); }

Ray Tracer::into(const Part& part, RTCRayN* rays, unsigned count, unsigned k) {
  const Vector from =
                   Vector{RTCRayN_org_x(rays, count, k), RTCRayN_org_y(rays, count, k), RTCRayN_org_z(rays, count, k)} -
                   part.transform->translation,
               way{RTCRayN_dir_x(rays, count, k), RTCRayN_dir_y(rays, count, k), RTCRayN_dir_z(rays, count, k)};
  const auto& [x, y, z] = part.inverse;
  return {{dot(x, from), dot(y, from), dot(z, from)},
          {dot(x, way), dot(y, way), dot(z, way)},
          RTCRayN_tfar(rays, count, k)};
}

void Tracer::bounds_of_part(const RTCBoundsFunctionArguments* arguments) {
  const Part& part = *static_cast<const Part*>(arguments->geometryUserPtr);
  Vector low{kInfinity, kInfinity, kInfinity}, high = -low;
  for (const auto& vertex : part.mesh->vertices) {
    const Vector p = part.transform->point(to_vector(vertex));
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  // Margins, because rays are rounded to float.
  const auto margin = [](double a, double b) { return std::max(std::abs(a), std::abs(b)) * 0x1p-20; };
  const Vector m{margin(low.x, high.x), margin(low.y, high.y), margin(low.z, high.z)};
  const auto [x0, y0, z0] = to_floats(low - m);
  const auto [x1, y1, z1] = to_floats(high + m);
  RTCBounds& out = *arguments->bounds_o;
  out.lower_x = x0, out.lower_y = y0, out.lower_z = z0;
  out.upper_x = x1, out.upper_y = y1, out.upper_z = z1;
}

void Tracer::intersect_part(const RTCIntersectFunctionNArguments* arguments) {
  const Part& part = *static_cast<const Part*>(arguments->geometryUserPtr);
  const unsigned all = arguments->N;
  RTCRayN* rays = RTCRayHitN_RayN(arguments->rayhit, all);
  RTCHitN* hits = RTCRayHitN_HitN(arguments->rayhit, all);
  const Active active(arguments->valid, all);
  const auto take = [&](unsigned to, float distance, unsigned triangle, float u, float v) {
    RTCRayN_tfar(rays, all, to) = distance;
    RTCHitN_geomID(hits, all, to) = arguments->geomID;
    RTCHitN_primID(hits, all, to) = triangle;
    RTCHitN_instID(hits, all, to, 0) = RTC_INVALID_GEOMETRY_ID;
    RTCHitN_u(hits, all, to) = u;
    RTCHitN_v(hits, all, to) = v;
  };
  if (active.count == 1) {
    RTCRayHit query;
    put(into(part, rays, all, active.lanes[0]), query.ray);
    query.hit.geomID = query.hit.primID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(part.shape, arguments->context, &query);
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID)
      take(active.lanes[0], query.ray.tfar, query.hit.primID, query.hit.u, query.hit.v);
    return;
  }
  const Valid valid(active.count);
  RTCRayHit16 query;
  for (unsigned k = 0; k < kPacket; ++k) {
    put(into(part, rays, all, active.lanes[k]), query.ray, k);
    query.hit.geomID[k] = query.hit.primID[k] = query.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
  }
  rtcIntersect16(valid.lanes, part.shape, arguments->context, &query);
  for (unsigned k = 0; k < active.count; ++k)
    if (query.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID)
      take(active.lanes[k], query.ray.tfar[k], query.hit.primID[k], query.hit.u[k], query.hit.v[k]);
}

void Tracer::occluded_part(const RTCOccludedFunctionNArguments* arguments) {
  const Part& part = *static_cast<const Part*>(arguments->geometryUserPtr);
  const unsigned all = arguments->N;
  const Active active(arguments->valid, all);
  if (active.count == 1) {
    RTCRay query;
    put(into(part, arguments->ray, all, active.lanes[0]), query);
    rtcOccluded1(part.shape, arguments->context, &query);
    if (query.tfar < 0) RTCRayN_tfar(arguments->ray, all, active.lanes[0]) = query.tfar;
    return;
  }
  const Valid valid(active.count);
  RTCRay16 query;
  for (unsigned k = 0; k < kPacket; ++k) put(into(part, arguments->ray, all, active.lanes[k]), query, k);
  rtcOccluded16(valid.lanes, part.shape, arguments->context, &query);
  for (unsigned k = 0; k < active.count; ++k)
    if (query.tfar[k] < 0) RTCRayN_tfar(arguments->ray, all, active.lanes[k]) = query.tfar[k];
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
  std::array<Corner, 3> made;
  const auto [a, b, c] = corners(meeting, made);
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
  std::array<Corner, 3> made;
  const auto [a, b, c] = corners(meeting, made);
  const double wb = meeting.u, wc = meeting.v, wa = 1 - wb - wc;
  return {a->uv[0] * wa + b->uv[0] * wb + c->uv[0] * wc, a->uv[1] * wa + b->uv[1] * wb + c->uv[1] * wc};
}

inline Point Tracer::point(const Place& place, const Vector& origin, const Vector& direction) {
  const auto& [a, b, c] = place.corners;
  const auto& [na, nb, nc] = place.normals;
  const double wb = place.u, wc = place.v, wa = 1 - wb - wc;
  Point out;
  // The point is interpolated from the corners, not computed along the ray, so that it lies in the plane of the
  // triangle.
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
    std::array<Corner, 3> made;
    const auto from = corners(m, made);
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
