// SPDX-License-Identifier: GPL-3.0-or-later
// Shared by all tracers: camera rays, sums over samples, timing and metadata.
#pragma once

#include <chrono>
#include <functional>

#include "reference/cone.h"
#include "reference/image.h"
#include "reference/render.h"
#include "reference/scene.h"

namespace brdfc::reference {

/// The camera ray through a point of the film, in pixels from the upper left corner.
inline void camera_ray(const Camera& c, int width, int height, double x, double y, Vec3<double>& origin,
                       Vec3<double>& direction) {
  const double scale = 2 * c.half_height / height;
  const double right = (x - width / 2.0) * scale, up = (height / 2.0 - y) * scale;
  const Vec3<double> offset = c.right * right + c.up * up;
  origin = select(c.orthographic, c.position + offset, c.position);
  direction = select(c.orthographic, c.forward, unit(c.forward + offset));
}

/// Mean and sum of squared deviations of a pixel's samples (Welford). Exact for constants, numerically stable
/// otherwise.
class PixelMoments {
 public:
  void add(const Rgb<double>& c) {
    ++count_;
    const double share = 1.0 / count_;
    channels_[0].add(c.r, share);
    channels_[1].add(c.g, share);
    channels_[2].add(c.b, share);
  }
  int count() const { return count_; }
  /// Adds the mean and its variance to pixel `i`. The variance of less than two samples is not added.
  void write(std::size_t i, Image& mean, Image& variance) const;

 private:
  struct Moments {
    double mean = 0, m2 = 0;
    void add(double x, double share) {
      const double d = x - mean;
      mean += d * share;
      m2 += d * (x - mean);
    }
  };
  std::array<Moments, 3> channels_;
  int count_ = 0;
};

/// Measures the time of a picture: in total, and of tracing alone.
class RenderClock {
 public:
  explicit RenderClock(const RenderOptions& options) : options_(options) {}
  /// Call when preparation is done and tracing begins.
  void begin_tracing() { traced_ = Clock::now(); }
  /// Seconds since construction, and since begin_tracing().
  double seconds() const { return since(start_); }
  double tracing() const { return since(traced_); }
  bool cancelled() const { return options_.cancel && options_.cancel->load(std::memory_order_relaxed); }
  /// True if the picture is cancelled or its time limit is reached.
  bool stop() const { return cancelled() || (options_.max_seconds > 0 && seconds() > options_.max_seconds); }

 private:
  using Clock = std::chrono::steady_clock;
  static double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }
  const RenderOptions& options_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point traced_ = start_;
};

/// Number of threads that the options ask for; by default all cores.
int threads_of(const RenderOptions&);
/// Runs f with this number of threads for TBB's loops, even if it exceeds the number of cores.
void in_arena(int threads, const std::function<void()>& f);

/// Metadata of RenderResult::rendering.
nlohmann::json render_metadata(const Scene& scene, const RenderSettings& settings, int least, int most, int threads,
                               const RenderClock& clock);

}  // namespace brdfc::reference
