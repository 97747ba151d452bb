// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/render.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <cmath>

#include "reference/film.h"
#include "reference/light_tracer.h"
#include "reference/path_tracer.h"

namespace brdfc::reference {

namespace {

constexpr int kTile = 16;
/// Number of paths that are traced together: enough to fill packets after many bounces, few enough for a core's cache.
constexpr int kWave = 1024;

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

  tbb::enumerable_thread_specific<PathTracer::Wave> waves([&] { return tracer.make_wave(); });
  const int together = options.wave > 0 ? options.wave : kWave;
  // Each pass adds the same number of samples to every pixel. Passes are short, so that a render that is stopped has
  // nearly the same number of samples everywhere. Pixels add up their samples in order, so the number of passes does
  // not change the result.
  const auto pass = [&](int from, int to, bool stoppable) {
    tbb::parallel_for(
        tbb::blocked_range<int>(0, tiles, 1),
        [&](const tbb::blocked_range<int>& range) {
          PathTracer::Wave& wave = waves.local();
          std::vector<PathTracer::Start> starts;
          std::vector<Rgb<double>> light;
          const auto follow = [&] {
            if (stoppable ? clock.stop() : clock.cancelled()) return false;
            light.resize(starts.size());
            tracer.follow(starts, wave, light);
            for (std::size_t i = 0; i < starts.size(); ++i)
              pixels[std::size_t(starts[i].y) * settings.width + starts[i].x].add(light[i]);
            paths += starts.size();
            starts.clear();
            return true;
          };
          for (int tile = range.begin(); tile < range.end(); ++tile) {
            const int x0 = tile % columns * kTile, y0 = tile / columns * kTile;
            for (int y = y0; y < std::min(y0 + kTile, settings.height); ++y)
              for (int x = x0; x < std::min(x0 + kTile, settings.width); ++x)
                for (int s = from; s < to; ++s) {
                  starts.push_back({x, y, s});
                  if (int(starts.size()) == together && !follow()) return;
                }
            if (!follow()) return;
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
    // Adapts the number of samples so that a pass takes about half a second.
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
  result.rendering.working_space = scene.working_space;
  result.rendering.metadata = render_metadata(scene, settings, least, most, threads, clock);
  return result;
}

}  // namespace brdfc::reference
