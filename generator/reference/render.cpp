// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/render.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "model/horizon.h"
#include "model/sampling.h"
#include "reference/lights.h"
#include "reference/random.h"
#include "reference/tracer.h"

namespace brdfc::reference {

namespace {

using Vector = Vec3<double>;
using Color = Rgb<double>;
using Clock = std::chrono::steady_clock;

constexpr int kTile = 16;
constexpr int kRouletteStart = 3;  // scatterings before a path may be ended by chance

/// A material ready to be evaluated, with what is known about it beforehand.
class Surface {
 public:
  explicit Surface(const Material& material)
      : material_(material),
        brdf_(material.model->make_double(material.values)),
        has_scatter_(material.model->has_scatter()),
        has_mirror_(material.model->has_mirror()),
        has_transmit_(material.model->has_transmit()),
        has_medium_(material.model->has_medium()) {
    if (!has_scatter_) return;
    Random random(0, 0, 0);
    for (int i = 0; i < kCosines; ++i) {
      double sum = 0;
      for (int k = 0; k < kSamples; ++k) {
        const double z = (i + random.uniform()) / kCosines, phi = 2 * kPi * random.uniform();
        const double s = std::sqrt(1 - z * z);
        const Sample<double> sample = brdf_->sample({s * std::cos(phi), s * std::sin(phi), z}, random.uniform3());
        sum += luminance(sample.weight);
      }
      albedo_[i] = sum / kSamples;
    }
  }

  bool has_scatter() const { return has_scatter_; }
  bool has_mirror() const { return has_mirror_; }
  bool has_transmit() const { return has_transmit_; }
  bool has_medium() const { return has_medium_; }

  /// Chance to follow one of the delta terms, whose weights add up to `delta`, rather than to sample the rest. Any
  /// number strictly between 0 and 1 is unbiased where both exist; the estimate of the rest's albedo only keeps the
  /// weights even.
  double delta_chance(const Color& delta, double cosine) const {
    const double m = luminance(delta);
    if (!has_scatter_) return 1;
    if (!(m > 0)) return 0;
    const double rest = albedo_[std::min(int(std::abs(cosine) * kCosines), kCosines - 1)];
    return std::min(std::max(m / (m + rest), 0.05), 0.95);
  }

  /// The BRDF at texture coordinates; `bound` keeps it alive if it is made for this place.
  const Brdf<double>& at(double u, double v, std::unique_ptr<Brdf<double>>& bound) const {
    if (material_.textures.empty()) return *brdf_;
    ParamValues values = material_.values;
    for (const auto& [name, image] : material_.textures) {
      const Color c = bilinear(*image, u, v, Wrap::Repeat, Wrap::Repeat);
      if (std::holds_alternative<double>(values[name]))
        values[name] = c.r;
      else
        values[name] = std::array<double, 3>{c.r, c.g, c.b};
    }
    bound = material_.model->make_double(values);
    return *bound;
  }

  [[noreturn]] void bad_value(const char* what, const Vector& wi, const Vector& wo, const Color& value) const {
    throw ValueError(fmt::format(
        "{} {}: {} = ({:.9g}, {:.9g}, {:.9g}) at wi = ({:.17g}, {:.17g}, {:.17g}), wo = ({:.17g}, {:.17g}, {:.17g})",
        material_.model->info().name, format_values(material_.model->info(), material_.values), what, value.r, value.g,
        value.b, wi.x, wi.y, wi.z, wo.x, wo.y, wo.z));
  }

  void check(const char* what, const Vector& wi, const Vector& wo, const Color& value) const {
    // Written so that NaN fails.
    const auto good = [](double x) { return x >= 0 && x < kInfinity; };
    if (!(good(value.r) && good(value.g) && good(value.b))) bad_value(what, wi, wo, value);
  }

 private:
  static constexpr int kCosines = 32, kSamples = 128;
  const Material& material_;
  std::unique_ptr<Brdf<double>> brdf_;
  const bool has_scatter_, has_mirror_, has_transmit_, has_medium_;
  std::array<double, kCosines> albedo_{};
};

class PathTracer {
 public:
  PathTracer(const Scene& scene, const RenderOptions& options)
      : scene_(scene),
        settings_(options.settings),
        strategy_(options.strategy),
        tracer_(scene),
        lights_(scene, options.strategy == Strategy::Light) {
    surfaces_.reserve(scene.materials.size());
    for (const Material& m : scene.materials) surfaces_.emplace_back(m);
  }

  /// Chances of the lights on the viewer's side of a surface and on the other.
  using Chances = std::array<std::vector<double>, 2>;

  /// One path through a pixel. `chances` is scratch memory of the thread.
  Color path(int x, int y, int sample, Chances& chances) const {
    Random random(std::uint64_t(settings_.seed), std::uint64_t(y) * settings_.width + x, std::uint64_t(sample));
    Vector origin, direction;
    const double film_x = x + random.uniform(), film_y = y + random.uniform();
    camera_ray(film_x, film_y, origin, direction);

    Color light(0), throughput(1, 1, 1);
    Hit hit;
    Vector normal;                                 // at the last scattering, on the side of the ray
    double scattered_pdf = 0;                      // of the direction, if another strategy could have found it
    const std::vector<double>* sampled = nullptr;  // the chances with which it could
    for (int bounce = 0;; ++bounce) {
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
      std::unique_ptr<Brdf<double>> bound;
      const Brdf<double>& brdf = surface.at(hit.u, hit.v, bound);
      if (hit.inside && surface.has_medium()) {
        const Color left = brdf.transmittance(hit.distance);
        surface.check("transmittance", direction, -direction, left);
        throughput = throughput * left;
      }
      // The frame of a model of two sides has its z outside.
      const double side = hit.inside && (surface.has_transmit() || brdf.scatters_through()) ? -1 : 1;
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
      const double squared_index = settings_.scale_radiance ? sqr(brdf.ior()) : 1;
      const double crossing = wo.z > 0 ? 1 / squared_index : squared_index;

      std::array<bool, 2> lit{};
      if (surface.has_scatter() && !lights_.empty())
        for (int far = 0; far <= int(brdf.scatters_through()); ++far) {
          const Vector facing = far ? -hit.geometric : hit.geometric;
          lit[far] = lights_.chances(hit.p, facing, chances[far]);
          if (lit[far])
            light += throughput * (far ? crossing : 1) *
                     direct(hit, facing, surface, brdf, to_local, wo, far, 1 - delta_chance, chances[far], random);
        }

      // Drawn in any case, so that a stream's place does not depend on the material.
      const double choose = random.uniform();
      const Vector u = random.uniform3();
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
  void camera_ray(double x, double y, Vector& origin, Vector& direction) const {
    const Camera& c = scene_.camera;
    const double scale = 2 * c.half_height / settings_.height;
    const double right = (x - settings_.width / 2.0) * scale, up = (settings_.height / 2.0 - y) * scale;
    const Vector offset = c.right * right + c.up * up;
    origin = c.orthographic ? c.position + offset : c.position;
    direction = c.orthographic ? c.forward : normalize(c.forward + offset);
  }

  double power_heuristic(double mine, double other) const {
    if (strategy_ != Strategy::Mis) return 1;
    const double ratio = other / mine;
    return 1 / (1 + ratio * ratio);
  }

  /// Light from one sampled direction on the side that `facing` points to, without the path's throughput. `far`: not
  /// the viewer's side.
  template <class ToLocal> Color direct(const Hit& hit, const Vector& facing, const Surface& surface,
                                        const Brdf<double>& brdf, const ToLocal& to_local, const Vector& wo, bool far,
                                        double rest_chance, const std::vector<double>& chance, Random& random) const {
    const double choice = random.uniform();
    const Vector u = random.uniform3();
    const LightSample s = lights_.sample(hit.p, facing, chance, choice, u.x, u.y, u.z);
    if (!(s.pdf > 0) || !(dot(s.wi, facing) > 0)) return Color(0);
    if (strategy_ == Strategy::Brdf && !s.delta) return Color(0);
    const Vector wi = to_local(s.wi);
    if (far ? !(wi.z * wo.z < 0) : !(wi.z * wo.z > 0)) return Color(0);
    const Color f = brdf.eval(wi, wo);
    surface.check("f", wi, wo, f);
    const Color value = f * s.radiance * std::abs(wi.z);
    if (!(max_component(value) > 0)) return Color(0);
    double weight = 1;
    if (!s.delta && strategy_ == Strategy::Mis) weight = power_heuristic(s.pdf, brdf.pdf(wi, wo) * rest_chance);
    const Vector origin = Tracer::leave(hit.p, hit.geometric, s.wi);
    // A little short of a lamp, which may lie in a surface.
    if (tracer_.occluded(origin, s.wi, s.distance * (1 - 0x1p-18))) return Color(0);
    return value * (weight / s.pdf);
  }

  const Scene& scene_;
  const RenderSettings settings_;
  const Strategy strategy_;
  const Tracer tracer_;
  const Lights lights_;
  std::vector<Surface> surfaces_;
};

/// Mean and sum of squared deviations of one channel (Welford): exact for constants, stable otherwise.
struct Moments {
  double mean = 0, m2 = 0;
  void add(double x, int count) {
    const double d = x - mean;
    mean += d / count;
    m2 += d * (x - mean);
  }
};

struct Pixel {
  std::array<Moments, 3> channel;
  int count = 0;
  void add(const Color& c) {
    ++count;
    channel[0].add(c.r, count);
    channel[1].add(c.g, count);
    channel[2].add(c.b, count);
  }
};

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

}  // namespace

RenderResult render(const Scene& scene, const RenderOptions& options) {
  const RenderSettings& settings = options.settings;
  const int threads = options.threads > 0 ? options.threads : int(std::max(1u, std::thread::hardware_concurrency()));
  const auto start = Clock::now();
  // TBB allows no more threads than cores unless told to.
  const tbb::global_control allow(
      tbb::global_control::max_allowed_parallelism,
      std::max(std::size_t(threads), tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)));
  tbb::task_arena arena(threads);
  const auto built = arena.execute([&] { return std::make_unique<const PathTracer>(scene, options); });
  const PathTracer& tracer = *built;
  const auto traced = Clock::now();
  const auto stop = [&] {
    return (options.cancel && options.cancel->load(std::memory_order_relaxed)) ||
           (options.max_seconds > 0 && seconds_since(start) > options.max_seconds);
  };

  const int columns = (settings.width + kTile - 1) / kTile, rows = (settings.height + kTile - 1) / kTile;
  const int tiles = columns * rows;
  std::vector<Pixel> pixels(std::size_t(settings.width) * settings.height);
  std::atomic<std::uint64_t> paths{0};

  // A pass gives every pixel the same number of further samples; passes are short, so that stopping loses little
  // evenness. Pixels add up their samples in order, so the number of passes does not change the result.
  const auto pass = [&](int from, int to, bool stoppable) {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, tiles, 1),
        [&](const tbb::blocked_range<int>& range) {
          PathTracer::Chances chances;
          for (int tile = range.begin(); tile < range.end(); ++tile) {
            const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
            std::uint64_t done = 0;
            for (int y = y0; y < std::min(y0 + kTile, settings.height); ++y)
              for (int x = x0; x < std::min(x0 + kTile, settings.width); ++x) {
                if (stoppable ? stop() : options.cancel && options.cancel->load(std::memory_order_relaxed)) return;
                Pixel& pixel = pixels[std::size_t(y) * settings.width + x];
                for (int s = from; s < to; ++s) pixel.add(tracer.path(x, y, s, chances));
                done += std::uint64_t(to - from);
              }
            paths += done;
          }
        },
        tbb::simple_partitioner());
  };
  int done = 0, step = 1;
  while (done < settings.spp && !(done > 0 && stop())) {
    const int to = int(std::min<std::int64_t>(std::int64_t(done) + step, settings.spp));
    const auto pass_start = Clock::now();
    arena.execute([&] { pass(done, to, done > 0); });
    if (options.cancel && options.cancel->load()) break;
    done = to;
    const double pass_seconds = seconds_since(pass_start);
    // Passes of about half a second.
    if (pass_seconds < 0.25) step *= 2;
    if (pass_seconds > 1 && step > 1) step /= 2;
    if (options.progress) {
      Progress p;
      p.samples = done;
      p.spp = settings.spp;
      p.seconds = seconds_since(start);
      const double tracing = seconds_since(traced);
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
  result.seconds = seconds_since(start);
  result.paths_per_second = double(paths) / std::max(seconds_since(traced), 1e-9);
  result.cancelled = options.cancel && options.cancel->load();
  Image mean(settings.width, settings.height), variance(settings.width, settings.height);
  int least = settings.spp, most = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const Pixel& p = pixels[i];
    least = std::min(least, p.count);
    most = std::max(most, p.count);
    for (int c = 0; c < 3; ++c) {
      mean.rgb[3 * i + c] = float(p.channel[c].mean);
      if (p.count > 1) variance.rgb[3 * i + c] = float(p.channel[c].m2 / (double(p.count) * (p.count - 1)));
    }
  }
  result.samples = least;
  result.rendering.mean = std::move(mean);
  if (least > 1) result.rendering.variance = std::move(variance);
  result.rendering.metadata = {
      {"scene", scene.name}, {"scene_hash", scene.hash},  {"seed", settings.seed},
      {"samples", least},    {"samples_max", most},       {"max_bounces", settings.max_bounces},
      {"threads", threads},  {"seconds", result.seconds}, {"version", BRDFC_VERSION}};
  return result;
}

}  // namespace brdfc::reference
