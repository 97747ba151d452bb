// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/path_tracer.h"

#include <cmath>

#include "model/horizon.h"
#include "model/sampling.h"
#include "reference/film.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;
using Color = Rgb<double>;

/// Dimensions of a bounce: which term, which lobe, its direction, and for each side which lamp, where, and where else.
constexpr std::uint64_t kDimensions = 9;
constexpr std::uint64_t dimension_of(int bounce) { return 1 + kDimensions * std::uint64_t(bounce); }

/// Random numbers of a direction towards a light.
struct LightChoice {
  double choice, u1, u2, u3;
  LightChoice(PathSampler& random, int bounce, bool far) {
    const std::uint64_t dimension = dimension_of(bounce) + 3 + 3 * std::uint64_t(far);
    choice = random.one(dimension);
    const auto place = random.two(dimension + 1);
    u1 = place[0], u2 = place[1];
    u3 = random.one(dimension + 2);
  }
};

/// Paths ahead of the one that scatters, whose memory is fetched.
constexpr std::size_t kAhead = 8;

}  // namespace

PathTracer::PathTracer(const Scene& scene, const RenderOptions& options)
    : scene_(scene),
      settings_(options.settings),
      strategy_(options.settings.strategy),
      points_(options.settings.pattern, options.settings.spp),
      tracer_(scene),
      lights_(scene, strategy_ == Strategy::Light) {
  surfaces_.reserve(scene.materials.size());
  for (const Material& m : scene.materials) surfaces_.emplace_back(m);
}

PathTracer::Wave PathTracer::make_wave() const { return Wave(surfaces_); }

void PathTracer::follow(std::span<const Start> starts, Wave& wave, std::span<Color> light) const {
  wave.paths.clear();
  wave.paths.reserve(starts.size());
  wave.active.clear();
  wave.rays.clear();
  wave.chances.resize(2 * lights_.count() * starts.size());
  for (const auto& [x, y, sample] : starts) {
    Path& path = wave.paths.emplace_back(
        PathSampler(points_, std::uint64_t(settings_.seed), std::uint64_t(y) * settings_.width + x, sample));
    const auto film = path.random.two(0);
    Ray& ray = wave.rays.emplace_back();
    camera_ray(scene_.camera, settings_, x + film[0], y + film[1], ray.origin, ray.direction);
    wave.active.push_back(&path);
  }

  for (int bounce = 0; !wave.active.empty(); ++bounce) {
    const std::size_t count = wave.active.size();
    wave.meetings.resize(count);
    tracer_.intersect(wave.rays, bounce == 0, wave.meetings);

    wave.hits.resize(count);
    wave.places.assign(surfaces_.size() + 1, 0);
    for (std::size_t i = 0; i < count; ++i) {
      Hit& hit = wave.hits[i];
      if (!tracer_.at(wave.rays[i], wave.meetings[i], hit)) {
        hit.material = -1;
        hit.distance = kInfinity;
        hit.environment = lights_.place(wave.rays[i].direction);
      }
      ++wave.places[std::size_t(hit.material + 1)];
    }
    for (std::size_t i = 0; i < count; ++i) collect(*wave.active[i], wave.rays[i], wave.hits[i], bounce == 0);
    if (bounce > settings_.max_bounces) break;

    int place = -wave.places[0];
    for (int& p : wave.places) place += std::exchange(p, place);
    wave.order.resize(std::size_t(place));
    for (std::size_t i = 0; i < count; ++i)
      if (const int material = wave.hits[i].material; material >= 0)
        wave.order[std::size_t(wave.places[std::size_t(material + 1)]++)] = int(i);

    wave.shadows.clear();
    wave.shadow_rays.clear();
    wave.next.clear();
    wave.next_rays.clear();
    const std::size_t scattering = wave.order.size();
    for (std::size_t k = 0; k < scattering; ++k) {
      if (k + 2 * kAhead < scattering) fetch(wave, k + 2 * kAhead, bounce, &EnvironmentSampler::fetch_slot);
      if (k + kAhead < scattering) fetch(wave, k + kAhead, bounce, &EnvironmentSampler::fetch_cell);
      const std::size_t i = std::size_t(wave.order[k]);
      Path* path = wave.active[i];
      if (scatter(*path, wave.rays[i].direction, wave.hits[i], bounce, wave)) wave.next.push_back(path);
    }
    wave.hidden.resize(wave.shadows.size());
    tracer_.occluded(wave.shadow_rays, wave.hidden);
    for (std::size_t i = 0; i < wave.shadows.size(); ++i)
      if (!wave.hidden[i]) wave.shadows[i].path->light += wave.shadows[i].light;
    std::swap(wave.active, wave.next);
    std::swap(wave.rays, wave.next_rays);
  }
  for (std::size_t i = 0; i < starts.size(); ++i) light[i] = wave.paths[i].light;
}

void PathTracer::fetch(const Wave& wave, std::size_t place, int bounce,
                       void (EnvironmentSampler::*what)(double) const) const {
  if (!lights_.samples_image()) return;
  const std::size_t i = std::size_t(wave.order[place]);
  const Surface& surface = surfaces_[std::size_t(wave.hits[i].material)];
  if (!surface.has_scatter()) return;
  PathSampler ahead = wave.active[i]->random;
  for (int far = 0; far <= int(surface.scatters_through()); ++far)
    (lights_.image().*what)(LightChoice(ahead, bounce, far).u1);
}

void PathTracer::collect(Path& path, const Ray& ray, const Hit& hit, bool from_camera) const {
  lights_.meet(ray.origin, ray.direction, hit.distance, hit.environment, path.normal, path.sampled, from_camera,
               [&](const Color& radiance, double light_pdf) {
                 if (!path.sampled || light_pdf == 0)
                   path.light += path.throughput * radiance;
                 else if (strategy_ != Strategy::Light)
                   path.light += path.throughput * radiance * power_heuristic(path.scattered_pdf, light_pdf);
               });
}

bool PathTracer::scatter(Path& path, const Vector& direction, const Hit& hit, int bounce, Wave& wave) const {
  PathSampler& random = path.random;
  Color& throughput = path.throughput;
  const std::uint64_t dimension = dimension_of(bounce);
  const Surface& surface = surfaces_[hit.material];
  const Brdf<double>& brdf = surface.at(hit.u, hit.v, wave.scratch.of(hit.material));
  if (hit.inside && surface.has_medium()) {
    const Color left = brdf.transmittance(hit.distance);
    surface.check("transmittance", direction, -direction, left);
    throughput = throughput * left;
  }
  // The frame of a model of two sides has its z outside.
  const double side = hit.inside && (surface.has_transmit() || surface.scatters_through()) ? -1 : 1;
  const Vector bitangent = cross(hit.normal, hit.tangent);
  const auto to_local = [&](const Vector& w) {
    return Vector{dot(w, hit.tangent), dot(w, bitangent), side * dot(w, hit.normal)};
  };
  Vector wo =
      raise_to_horizon(Vector{-dot(direction, hit.tangent), -dot(direction, bitangent), -dot(direction, hit.normal)});
  wo.z *= side;
  Color mirror(0), transmit(0);
  if (surface.has_mirror()) {
    mirror = brdf.mirror(wo);
    surface.check("mirror", {-wo.x, -wo.y, wo.z}, wo, mirror);
  }
  if (surface.has_transmit()) {
    transmit = brdf.transmit(wo);
    surface.check("transmit", refract(wo, brdf.ior()), wo, transmit);
  }
  const double delta_chance =
      surface.has_mirror() || surface.has_transmit() ? surface.delta_chance(mirror + transmit, wo.z) : 0;
  // What crossing does to radiance.
  const auto crossing_by = [&](double ior) {
    return !settings_.scale_radiance ? 1 : wo.z > 0 ? 1 / sqr(ior) : sqr(ior);
  };
  double crossing = crossing_by(brdf.ior());

  const std::size_t lights = lights_.count();
  double* const first = wave.chances.data() + 2 * lights * std::size_t(&path - wave.paths.data());
  const auto chances = [&](bool far) { return std::span<double>(first + far * lights, lights); };
  std::array<bool, 2> lit{};
  if (surface.has_scatter() && !lights_.empty())
    for (int far = 0; far <= int(surface.scatters_through()); ++far) {
      const Vector facing = far ? -hit.geometric : hit.geometric;
      lit[far] = lights_.chances(hit.p, facing, chances(far));
      if (lit[far])
        direct(path, throughput * (far ? crossing : 1), hit, facing, surface, brdf, to_local, wo, far, 1 - delta_chance,
               chances(far), bounce, wave);
    }

  // Drawn in any case, so that a stream's place does not depend on the material.
  const double choose = random.one(dimension), lobe = random.one(dimension + 1);
  const auto way = random.two(dimension + 2);
  const Vector u{lobe, way[0], way[1]};
  Vector wi;
  path.sampled = nullptr;
  if (choose < delta_chance) {
    const double share = luminance(mirror) / luminance(mirror + transmit);
    if (choose < delta_chance * share) {
      wi = {-wo.x, -wo.y, wo.z};
      throughput = throughput * mirror / (delta_chance * share);
    } else {
      throughput = throughput * transmit / (delta_chance * (1 - share));
      const Bent bent = bend(brdf.channel_iors(), throughput, (choose / delta_chance - share) / (1 - share));
      wi = refract(wo, bent.ior);
      crossing = crossing_by(bent.ior);
      throughput = bent.throughput;
    }
  } else {
    const Sample<double> s = brdf.sample(wo, u);
    surface.check("sample weight", s.wi, wo, s.weight);
    if (!(s.pdf > 0)) {
      if (s.pdf == 0) return false;
      surface.bad_value("sample pdf", s.wi, wo, Color(s.pdf));
    }
    wi = s.wi;
    throughput = throughput * s.weight / (1 - delta_chance);
    path.scattered_pdf = s.pdf * (1 - delta_chance);
    const bool far = wi.z * wo.z < 0;
    if (lit[far]) path.sampled = chances(far).data();
  }
  const bool crosses = wi.z * wo.z < 0;
  if (crosses) throughput = throughput * crossing;
  path.normal = crosses ? -hit.geometric : hit.geometric;
  const Vector out = normalize(hit.tangent * wi.x + bitangent * wi.y + hit.normal * (side * wi.z));
  if (!(dot(out, path.normal) > 0)) return false;
  const double brightest = max_component(throughput);
  if (!(brightest > 0)) return false;
  if (bounce + 1 >= kRouletteStart && brightest < 1) {
    if (random.uniform() >= brightest) return false;
    throughput = throughput / brightest;
  }
  wave.next_rays.push_back({Tracer::leave(hit.p, hit.geometric, out), out});
  return true;
}

template <class ToLocal>
void PathTracer::direct(Path& path, const Color& throughput, const Hit& hit, const Vector& facing,
                        const Surface& surface, const Brdf<double>& brdf, const ToLocal& to_local, const Vector& wo,
                        bool far, double rest_chance, std::span<const double> chance, int bounce, Wave& wave) const {
  const LightChoice u(path.random, bounce, far);
  const LightSample s = lights_.sample(hit.p, facing, chance, u.choice, u.u1, u.u2, u.u3);
  if (!(s.pdf > 0) || !(dot(s.wi, facing) > 0)) return;
  if (strategy_ == Strategy::Brdf && !s.delta) return;
  const Vector wi = to_local(s.wi);
  if (far ? !(wi.z * wo.z < 0) : !(wi.z * wo.z > 0)) return;
  const auto [f, pdf] = brdf.evaluate(wi, wo);
  surface.check("f", wi, wo, f);
  const Color value = f * s.radiance * std::abs(wi.z);
  if (!(max_component(value) > 0)) return;
  const double weight = s.delta ? 1 : power_heuristic(s.pdf, pdf * rest_chance);
  wave.shadows.push_back({&path, throughput * (value * (weight / s.pdf))});
  // A little short of a lamp, which may lie in a surface.
  wave.shadow_rays.push_back({Tracer::leave(hit.p, hit.geometric, s.wi), s.wi, s.distance * (1 - 0x1p-18)});
}

}  // namespace brdfc::reference
