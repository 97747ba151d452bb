// SPDX-License-Identifier: GPL-3.0-or-later
// Paths from the camera, many at a time.
//
// The paths of a wave take each step together: their rays are traced in packets, then they scatter, those on one
// material after the other, then the rays towards lights are traced. No path knows of another: the light that it brings
// is the same to the last bit whatever is in the wave.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "reference/lights.h"
#include "reference/patterns.h"
#include "reference/render.h"
#include "reference/surface.h"
#include "reference/tracer.h"

namespace brdfc::reference {

class PathTracer {
 public:
  PathTracer(const Scene& scene, const RenderOptions& options);

  /// Sample `sample` of a pixel.
  struct Start {
    int x, y, sample;
  };
  /// Memory of a thread.
  class Wave;
  Wave make_wave() const;

  /// The light that each path brings.
  void follow(std::span<const Start> starts, Wave& wave, std::span<Rgb<double>> light) const;

 private:
  struct Path;
  struct Shadow;

  /// Adds the light that the path's ray meets on its way.
  void collect(Path& path, const Ray& ray, const Hit& hit, bool from_camera) const;
  /// Lets the environment's image fetch what the light samples of a path will read, which is at a place in the order.
  void fetch(const Wave& wave, std::size_t place, int bounce, void (EnvironmentSampler::*what)(double) const) const;
  /// Puts into `wave.next_rays` where a path goes that came along `direction`, or returns false if it ends there. Light
  /// from the lamps is promised to `wave.shadows`.
  bool scatter(Path& path, const Vec3<double>& direction, const Hit& hit, int bounce, Wave& wave) const;
  /// Light from one sampled direction on the side that `facing` points to, `throughput` being the
  /// path's, on that side.
  /// `far`: not the viewer's side.
  template <class ToLocal> void direct(Path& path, const Rgb<double>& throughput, const Hit& hit,
                                       const Vec3<double>& facing, const Surface& surface, const Brdf<double>& brdf,
                                       const ToLocal& to_local, const Vec3<double>& wo, bool far, double rest_chance,
                                       std::span<const double> chance, int bounce, Wave& wave) const;
  /// 1 where one strategy alone finds light.
  double power_heuristic(double mine, double other) const {
    if (strategy_ != Strategy::Mis) return 1;
    const double ratio = other / mine;
    return 1 / (1 + ratio * ratio);
  }

  const Scene& scene_;
  const RenderSettings settings_;
  const Strategy strategy_;
  const PatternPoints points_;
  const Tracer tracer_;
  const Lights lights_;
  std::vector<Surface> surfaces_;
};

/// A path on its way.
struct PathTracer::Path {
  PathSampler random;
  Vec3<double> normal;              // at the last scattering, on the side of the ray
  double scattered_pdf = 0;         // of the direction, if another strategy could have found it
  const double* sampled = nullptr;  // the chances with which it could
  Rgb<double> light{0, 0, 0}, throughput{1, 1, 1};

  explicit Path(const PathSampler& r) : random(r) {}
};

/// Light that a path gets unless something is in the way.
struct PathTracer::Shadow {
  Path* path;
  Rgb<double> light;
};

class PathTracer::Wave {
  friend class PathTracer;
  explicit Wave(const std::vector<Surface>& surfaces) : scratch(surfaces), places(surfaces.size() + 1) {}

  std::vector<Path> paths;
  std::vector<double> chances;  // for each path, of the lights on the viewer's side of a surface and on the other
  std::vector<Path*> active, next;
  std::vector<Ray> rays, next_rays;  // of `active` and `next`
  std::vector<Meeting> meetings;
  std::vector<Hit> hits;
  std::vector<int> order;  // of the hits, by material
  std::vector<Shadow> shadows;
  std::vector<Ray> shadow_rays;
  std::vector<std::uint8_t> hidden;
  SurfaceScratch scratch;
  std::vector<int> places;  // in the order, of each material's first
};

}  // namespace brdfc::reference
