// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/render.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "model/horizon.h"
#include "model/sampling.h"
#include "reference/film.h"
#include "reference/light_tracer.h"
#include "reference/lights.h"
#include "reference/patterns.h"
#include "reference/surface.h"
#include "reference/tracer.h"

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;
using Color = Rgb<double>;

constexpr int kTile = 16;

class PathTracer {
 public:
  PathTracer(const Scene& scene, const RenderOptions& options)
      : scene_(scene),
        settings_(options.settings),
        strategy_(options.settings.strategy),
        points_(options.settings.pattern, options.settings.spp),
        tracer_(scene),
        lights_(scene, strategy_ == Strategy::Light) {
    surfaces_.reserve(scene.materials.size());
    for (const Material& m : scene.materials) surfaces_.emplace_back(m);
  }

  /// Memory of a thread.
  struct Scratch {
    /// Chances of the lights on the viewer's side of a surface and on the other.
    std::array<std::vector<double>, 2> chances;
    SurfaceScratch surfaces;
  };
  Scratch make_scratch() const { return {{}, SurfaceScratch(surfaces_)}; }

  /// One path through a pixel.
  Color path(int x, int y, int sample, Scratch& scratch) const {
    auto& chances = scratch.chances;
    PathSampler random(points_, std::uint64_t(settings_.seed), std::uint64_t(y) * settings_.width + x, sample);
    Vector origin, direction;
    const auto film = random.two(0);
    camera_ray(scene_.camera, settings_, x + film[0], y + film[1], origin, direction);

    Color light(0), throughput(1, 1, 1);
    Hit hit;
    Vector normal;                                 // at the last scattering, on the side of the ray
    double scattered_pdf = 0;                      // of the direction, if another strategy could have found it
    const std::vector<double>* sampled = nullptr;  // the chances with which it could
    for (int bounce = 0;; ++bounce) {
      const std::uint64_t dimension = 1 + kDimensions * std::uint64_t(bounce);
      const bool from_camera = bounce == 0;
      const bool found = tracer_.intersect(origin, direction, from_camera, hit);
      lights_.meet(origin, direction, found ? hit.distance : kInfinity, normal, sampled, from_camera,
                   [&](const Color& radiance, double light_pdf) {
                     if (!sampled || light_pdf == 0)
                       light += throughput * radiance;
                     else if (strategy_ != Strategy::Light)
                       light += throughput * radiance * power_heuristic(scattered_pdf, light_pdf);
                   });
      if (!found || bounce > settings_.max_bounces) break;

      const Surface& surface = surfaces_[hit.material];
      const Brdf<double>& brdf = surface.at(hit.u, hit.v, scratch.surfaces.of(hit.material));
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
      Vector wo = raise_to_horizon(
          Vector{-dot(direction, hit.tangent), -dot(direction, bitangent), -dot(direction, hit.normal)});
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
      double crossing = 1;
      if (settings_.scale_radiance) {
        const double squared_index = sqr(brdf.ior());
        crossing = wo.z > 0 ? 1 / squared_index : squared_index;
      }

      std::array<bool, 2> lit{};
      if (surface.has_scatter() && !lights_.empty())
        for (int far = 0; far <= int(surface.scatters_through()); ++far) {
          const Vector facing = far ? -hit.geometric : hit.geometric;
          lit[far] = lights_.chances(hit.p, facing, chances[far]);
          if (lit[far])
            light += throughput * (far ? crossing : 1) *
                     direct(hit, facing, surface, brdf, to_local, wo, far, 1 - delta_chance, chances[far], random,
                            dimension + 3 + 3 * std::uint64_t(far));
        }

      // Drawn in any case, so that a stream's place does not depend on the material.
      const double choose = random.one(dimension), lobe = random.one(dimension + 1);
      const auto way = random.two(dimension + 2);
      const Vector u{lobe, way[0], way[1]};
      Vector wi;
      sampled = nullptr;
      if (choose < delta_chance) {
        const double share = luminance(mirror) / luminance(mirror + transmit);
        if (choose < delta_chance * share) {
          wi = {-wo.x, -wo.y, wo.z};
          throughput = throughput * mirror / (delta_chance * share);
        } else {
          wi = refract(wo, brdf.ior());
          throughput = throughput * transmit / (delta_chance * (1 - share));
        }
      } else {
        const Sample<double> s = brdf.sample(wo, u);
        surface.check("sample weight", s.wi, wo, s.weight);
        if (!(s.pdf > 0)) {
          if (s.pdf == 0) break;
          surface.bad_value("sample pdf", s.wi, wo, Color(s.pdf));
        }
        wi = s.wi;
        throughput = throughput * s.weight / (1 - delta_chance);
        scattered_pdf = s.pdf * (1 - delta_chance);
        const bool far = wi.z * wo.z < 0;
        if (lit[far]) sampled = &chances[far];
      }
      const bool crosses = wi.z * wo.z < 0;
      if (crosses) throughput = throughput * crossing;
      normal = crosses ? -hit.geometric : hit.geometric;
      direction = normalize(hit.tangent * wi.x + bitangent * wi.y + hit.normal * (side * wi.z));
      if (!(dot(direction, normal) > 0)) break;
      const double brightest = max_component(throughput);
      if (!(brightest > 0)) break;
      if (bounce + 1 >= kRouletteStart && brightest < 1) {
        if (random.uniform() >= brightest) break;
        throughput = throughput / brightest;
      }
      origin = Tracer::leave(hit.p, hit.geometric, direction);
    }
    return light;
  }

 private:
  /// 1 where one strategy alone finds light.
  double power_heuristic(double mine, double other) const {
    if (strategy_ != Strategy::Mis) return 1;
    const double ratio = other / mine;
    return 1 / (1 + ratio * ratio);
  }

  /// Dimensions of a bounce: which term, which lobe, its direction, and for each side which lamp, where, and where
  /// else.
  static constexpr std::uint64_t kDimensions = 9;

  /// Light from one sampled direction on the side that `facing` points to, without the path's throughput. `far`: not
  /// the viewer's side.
  template <class ToLocal> Color direct(const Hit& hit, const Vector& facing, const Surface& surface,
                                        const Brdf<double>& brdf, const ToLocal& to_local, const Vector& wo, bool far,
                                        double rest_chance, const std::vector<double>& chance, PathSampler& random,
                                        std::uint64_t dimension) const {
    const double choice = random.one(dimension);
    const auto place = random.two(dimension + 1);
    const LightSample s = lights_.sample(hit.p, facing, chance, choice, place[0], place[1], random.one(dimension + 2));
    if (!(s.pdf > 0) || !(dot(s.wi, facing) > 0)) return Color(0);
    if (strategy_ == Strategy::Brdf && !s.delta) return Color(0);
    const Vector wi = to_local(s.wi);
    if (far ? !(wi.z * wo.z < 0) : !(wi.z * wo.z > 0)) return Color(0);
    const auto [f, pdf] = brdf.evaluate(wi, wo);
    surface.check("f", wi, wo, f);
    const Color value = f * s.radiance * std::abs(wi.z);
    if (!(max_component(value) > 0)) return Color(0);
    const double weight = s.delta ? 1 : power_heuristic(s.pdf, pdf * rest_chance);
    const Vector origin = Tracer::leave(hit.p, hit.geometric, s.wi);
    // A little short of a lamp, which may lie in a surface.
    if (tracer_.occluded(origin, s.wi, s.distance * (1 - 0x1p-18))) return Color(0);
    return value * (weight / s.pdf);
  }

  const Scene& scene_;
  const RenderSettings settings_;
  const Strategy strategy_;
  const PatternPoints points_;
  const Tracer tracer_;
  const Lights lights_;
  std::vector<Surface> surfaces_;
};

}  // namespace

RenderResult render(const Scene& scene, const RenderOptions& options) {
  if (options.origin != Origin::Camera) return render_from_lamps(scene, options);
  const RenderSettings& settings = options.settings;
  const int threads = threads_of(options);
  RenderClock clock(options);
  std::unique_ptr<const PathTracer> built;
  in_arena(threads, [&] { built = std::make_unique<const PathTracer>(scene, options); });
  const PathTracer& tracer = *built;
  clock.begin_tracing();

  const int columns = (settings.width + kTile - 1) / kTile, rows = (settings.height + kTile - 1) / kTile;
  const int tiles = columns * rows;
  std::vector<PixelMoments> pixels(std::size_t(settings.width) * settings.height);
  std::atomic<std::uint64_t> paths{0};

  tbb::enumerable_thread_specific<PathTracer::Scratch> scratches([&] { return tracer.make_scratch(); });
  // A pass gives every pixel the same number of further samples; passes are short, so that stopping loses little
  // evenness. Pixels add up their samples in order, so the number of passes does not change the result.
  const auto pass = [&](int from, int to, bool stoppable) {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, tiles, 1),
        [&](const tbb::blocked_range<int>& range) {
          PathTracer::Scratch& scratch = scratches.local();
          for (int tile = range.begin(); tile < range.end(); ++tile) {
            const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
            std::uint64_t done = 0;
            for (int y = y0; y < std::min(y0 + kTile, settings.height); ++y)
              for (int x = x0; x < std::min(x0 + kTile, settings.width); ++x) {
                if (stoppable ? clock.stop() : clock.cancelled()) return;
                PixelMoments& pixel = pixels[std::size_t(y) * settings.width + x];
                for (int s = from; s < to; ++s) pixel.add(tracer.path(x, y, s, scratch));
                done += std::uint64_t(to - from);
              }
            paths += done;
          }
        },
        tbb::simple_partitioner());
  };
  int done = 0, step = 1;
  while (done < settings.spp && !(done > 0 && clock.stop())) {
    const int to = int(std::min<std::int64_t>(std::int64_t(done) + step, settings.spp));
    const double pass_start = clock.seconds();
    in_arena(threads, [&] { pass(done, to, done > 0); });
    if (clock.cancelled()) break;
    done = to;
    const double pass_seconds = clock.seconds() - pass_start;
    // Passes of about half a second.
    if (pass_seconds < 0.25) step *= 2;
    if (pass_seconds > 1 && step > 1) step /= 2;
    if (options.progress) {
      Progress p;
      p.samples = done;
      p.spp = settings.spp;
      p.seconds = clock.seconds();
      const double tracing = clock.tracing();
      p.fraction = double(done) / settings.spp;
      p.seconds_left = tracing * (settings.spp - done) / done;
      if (options.max_seconds > 0) {
        p.seconds_left = std::min(p.seconds_left, std::max(options.max_seconds - p.seconds, 0.0));
        p.fraction = std::max(p.fraction, std::min(p.seconds / options.max_seconds, 1.0));
      }
      p.paths_per_second = double(paths) / tracing;
      options.progress(p);
    }
  }

  RenderResult result;
  result.seconds = clock.seconds();
  result.paths_per_second = double(paths) / std::max(clock.tracing(), 1e-9);
  result.cancelled = clock.cancelled();
  Image mean(settings.width, settings.height), variance(settings.width, settings.height);
  int least = settings.spp, most = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    least = std::min(least, pixels[i].count());
    most = std::max(most, pixels[i].count());
    pixels[i].write(i, mean, variance);
  }
  result.samples = least;
  result.rendering.mean = std::move(mean);
  if (least > 1) result.rendering.variance = std::move(variance);
  result.rendering.metadata = render_metadata(scene, settings, least, most, threads, result.seconds);
  return result;
}

}  // namespace brdfc::reference
