// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/light_tracer.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "core/error.h"
#include "model/horizon.h"
#include "reference/emitter.h"
#include "reference/film.h"
#include "reference/random.h"
#include "reference/surface.h"
#include "reference/tracer.h"

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;
using Color = Rgb<double>;

/// The particles are divided into batches; the variance is estimated from the differences between their pictures.
constexpr int kBatches = 64;

/// Sums over particles: one colour per pixel.
struct Film {
  int width, height;
  std::vector<Color> sum;
  Film(int w, int h) : width(w), height(h), sum(std::size_t(w) * std::size_t(h), Color(0)) {}
};

class LightTracer {
 public:
  LightTracer(const Scene& scene, const RenderOptions& options)
      : scene_(scene),
        settings_(options.settings),
        swapped_(options.origin == Origin::LampsSwapped),
        tracer_(scene, options.most_copies),
        emitter_(scene, tracer_.bounds()),
        pixel_(2 * scene.camera.half_height / options.settings.height) {
    surfaces_.reserve(scene.materials.size());
    for (const Material& m : scene.materials) surfaces_.emplace_back(m);
  }

  SurfaceScratch make_scratch() const { return SurfaceScratch(surfaces_); }

  /// Traces one particle, and adds it to the film wherever the camera sees it.
  void particle(std::uint64_t index, SurfaceScratch& scratch, Film& film) const {
    if (emitter_.empty()) return;
    Random random(std::uint64_t(settings_.seed), index, 0);
    const double choice = random.uniform();
    const Vector where = random.uniform3();
    const double way = random.uniform();
    const EmittedRay ray = emitter_.emit(choice, {where.x, where.y, where.z}, {way, random.uniform()});
    const double sent = max_component(ray.power);
    if (!(sent > 0)) return;
    Vector origin = ray.origin, direction = ray.direction;
    Color power = ray.power;
    Hit hit;
    for (int scatterings = 1; scatterings <= settings_.max_bounces + 1; ++scatterings) {
      if (!tracer_.intersect({origin, direction}, false, hit)) return;
      const Surface& surface = surfaces_[std::size_t(hit.material)];
      const Brdf<double>& brdf = surface.at(hit.u, hit.v, scratch.of(hit.material));
      const Vector bitangent = cross(hit.normal, hit.tangent);
      const auto to_local = [&](const Vector& w) {
        return Vector{dot(w, hit.tangent), dot(w, bitangent), dot(w, hit.normal)};
      };
      const Vector from = to_local(-direction);
      if (!(from.z > 0)) return;  // no model reflects light that arrives from below its normal
      // Converts light that crosses the triangle to light that arrives at a surface with the shading normal.
      power = power * (from.z / -dot(direction, hit.geometric));
      join(hit, surface, brdf, to_local, from, power, film);

      const Vector u = random.uniform3();
      const Sample<double> s = brdf.sample(from, u);
      surface.check("sample weight", s.wi, from, s.weight);
      if (!(s.pdf > 0)) return;
      direction = normalize(hit.tangent * s.wi.x + bitangent * s.wi.y + hit.normal * s.wi.z);
      const double out = dot(direction, hit.geometric);
      if (!(out > 0)) return;
      if (swapped_) {
        power = power * s.weight * (out / s.wi.z);
      } else {
        const Color f = brdf.eval(from, s.wi);
        surface.check("f", from, s.wi, f);
        power = power * f * (out / s.pdf);
      }
      const double left = max_component(power) / sent;
      if (!(left > 0)) return;
      if (scatterings >= kRouletteStart && left < 1) {
        if (random.uniform() >= left) return;
        power = power / left;
      }
      origin = Tracer::leave(hit.p, hit.geometric, direction);
    }
  }

  /// The lamps and the environment as the camera sees them directly.
  PixelMoments seen(const Lights& lights, int x, int y, int spp) const {
    PixelMoments out;
    Hit hit;
    Rays rays;
    Numbers distance;
    Lanes<Color> light;
    for (int from = 0; from < spp; from += int(kBlock)) {
      const std::size_t count = std::min(kBlock, std::size_t(spp - from));
      for (std::size_t k = 0; k < count; ++k) {
        Random random(std::uint64_t(settings_.seed), std::uint64_t(y) * settings_.width + x, std::uint64_t(from) + k);
        Vector origin, direction;
        const double film_x = x + random.uniform(), film_y = y + random.uniform();
        camera_ray(scene_.camera, settings_.width, settings_.height, film_x, film_y, origin, direction);
        distance[k] = tracer_.intersect({origin, direction}, true, hit) ? hit.distance : kInfinity;
        rays.origin.set(k, origin);
        rays.direction.set(k, direction);
        light[k] = Color(0);
      }
      lights.meet(rays, distance, count, {}, {}, true,
                  [&](std::size_t k, const Color& radiance, double) { light[k] += radiance; });
      for (std::size_t k = 0; k < count; ++k) out.add(light[k]);
    }
    return out;
  }

 private:
  /// Connects a hit with the camera, and adds the light that it reflects straight to the camera. The value of a pixel
  /// is the mean, over its area on the film, of the radiance that arrives there. The change of variables from film to
  /// solid angle to surface gives each watt per steradian that is reflected the weight cos / (A d^2 cos^3 a), where d
  /// is the distance, a the angle to the view axis, and A the pixel's area on the film at distance 1. For an
  /// orthographic camera the weight is cos / A.
  template <class ToLocal> void join(const Hit& hit, const Surface& surface, const Brdf<double>& brdf,
                                     const ToLocal& to_local, const Vector& from, const Color& power,
                                     Film& film) const {
    const Camera& c = scene_.camera;
    const Vector d = c.position - hit.p;
    const double depth = -dot(d, c.forward);
    if (!(depth > 0)) return;
    const Vector across = c.orthographic ? -d : -d / depth;
    const double column = dot(across, c.right) / pixel_ + film.width / 2.0;
    const double row = film.height / 2.0 - dot(across, c.up) / pixel_;
    if (!(column >= 0 && column < film.width && row >= 0 && row < film.height)) return;
    const double distance = c.orthographic ? depth : length(d);
    const Vector to_camera = c.orthographic ? -c.forward : d / distance;
    const double cosine = dot(to_camera, hit.geometric);
    if (!(cosine > 0)) return;
    const Vector to = raise_to_horizon(to_local(to_camera));
    const Color f = swapped_ ? brdf.eval(to, from) : brdf.eval(from, to);
    surface.check("f", swapped_ ? to : from, swapped_ ? from : to, f);
    double weight = cosine / (pixel_ * pixel_);
    if (!c.orthographic) weight *= distance / (depth * depth * depth);  // 1 / (d^2 cos^3 a)
    const Color value = power * f * weight;
    if (!(max_component(value) > 0)) return;
    if (tracer_.occluded({Tracer::leave(hit.p, hit.geometric, to_camera), to_camera, distance * (1 - 0x1p-18)})) return;
    film.sum[std::size_t(row) * std::size_t(film.width) + std::size_t(column)] += value;
  }

  const Scene& scene_;
  const RenderSettings settings_;
  const bool swapped_;
  const Tracer tracer_;
  const Emitter emitter_;
  const double pixel_;  // side of a pixel, on the film at distance 1; orthographic: in scene units
  std::vector<Surface> surfaces_;
};

void require_reachable(const Scene& scene) {
  for (const Material& m : scene.materials) {
    const Surface surface(m);
    const char* has = surface.has_mirror()                                   ? "reflects as a mirror"
                      : surface.has_transmit() || surface.scatters_through() ? "lets light through"
                                                                             : nullptr;
    if (has)
      input_error(
          "{}: material \"{}\": {} {}, expected surfaces that scatter alone where light is traced from the lamps",
          scene.name, m.id, m.model->info().name, has);
  }
  for (const Object& o : scene.objects)
    if (o.camera_only)
      input_error(
          "{}: object \"{}\": \"camera_only\", expected objects that light meets where it is traced from the lamps",
          scene.name, o.name);
}

}  // namespace

RenderResult render_from_lamps(const Scene& scene, const RenderOptions& options) {
  require_reachable(scene);
  RenderClock clock(options);
  const RenderSettings& settings = options.settings;
  const int width = settings.width, height = settings.height;
  const std::size_t pixels = std::size_t(width) * std::size_t(height);
  const LightTracer tracer(scene, options);
  const Lights lights(scene, false);
  clock.begin_tracing();
  const std::uint64_t particles = std::uint64_t(pixels) * std::uint64_t(settings.spp);

  // Batches are added in a fixed order, whichever thread renders them, so the picture depends on the seed alone.
  const int threads = threads_of(options);
  std::vector<PixelMoments> moments(pixels);
  int done = 0;
  std::uint64_t traced_particles = 0;
  while (done < kBatches && !(done > 0 && clock.stop())) {
    const int wave = std::min(threads, kBatches - done);
    std::vector<Film> films(std::size_t(wave), Film(width, height));
    std::vector<std::uint64_t> counts(std::size_t(wave), 0);
    in_arena(threads, [&] {
      tbb::parallel_for(0, wave, [&](int i) {
        const auto batch = std::uint64_t(done + i);
        const std::uint64_t from = particles * batch / kBatches, to = particles * (batch + 1) / kBatches;
        SurfaceScratch scratch = tracer.make_scratch();
        for (std::uint64_t k = from; k < to; ++k) tracer.particle(k, scratch, films[std::size_t(i)]);
        counts[std::size_t(i)] = to - from;
      });
    });
    for (int i = 0; i < wave; ++i) {
      const double scale = counts[std::size_t(i)] ? 1 / double(counts[std::size_t(i)]) : 0;
      for (std::size_t p = 0; p < pixels; ++p) moments[p].add(films[std::size_t(i)].sum[p] * scale);
      traced_particles += counts[std::size_t(i)];
    }
    done += wave;
    if (options.progress) {
      Progress p;
      p.fraction = double(done) / kBatches;
      p.samples = settings.spp * done / kBatches;
      p.spp = settings.spp;
      p.seconds = clock.seconds();
      p.seconds_left = clock.tracing() * (kBatches - done) / done;
      p.paths_per_second = double(traced_particles) / clock.tracing();
      options.progress(p);
    }
  }

  Image mean(width, height), variance(width, height);
  const bool shines =
      scene.environment.image || max_component(scene.environment.color) > 0 ||
      std::any_of(scene.lights.begin(), scene.lights.end(), [](const Light& l) { return l.camera_visible; });
  in_arena(threads, [&] {
    tbb::parallel_for(0, height, [&](int y) {
      for (int x = 0; x < width; ++x) {
        const std::size_t i = std::size_t(y) * std::size_t(width) + std::size_t(x);
        moments[i].write(i, mean, variance);
        if (shines) tracer.seen(lights, x, y, settings.spp).write(i, mean, variance);
      }
    });
  });
  RenderResult result;
  result.samples = settings.spp * done / kBatches;
  result.seconds = clock.seconds();
  result.paths_per_second = double(traced_particles) / std::max(clock.tracing(), 1e-9);
  result.cancelled = clock.cancelled();
  result.rendering.mean = std::move(mean);
  result.rendering.variance = std::move(variance);
  result.rendering.working_space = scene.working_space;
  result.rendering.metadata = render_metadata(scene, settings, result.samples, result.samples, threads, clock);
  return result;
}

}  // namespace brdfc::reference
