// SPDX-License-Identifier: GPL-3.0-or-later
// Paths from the camera, many at a time.
//
// The paths of a wave take each step together: their rays are traced in packets, then they scatter, those on one
// material after the other in blocks, then the rays towards lights are traced. No path knows of another: the light that
// it brings is the same to the last bit whatever is in the wave.
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
  struct Block;

  /// Makes the order of the rays: first those that leave the scene, then those on each material.
  void sort_by_material(Wave& wave) const;
  /// Puts active paths and their rays into the block, those in the order's places from `from` on before `end`.
  void gather(int from, int end, Wave& wave) const;
  /// One or two numbers of a dimension for each path.
  void draw(const Block& b, std::uint64_t dimension, Numbers& first) const;
  void draw(const Block& b, std::uint64_t dimension, Numbers& first, Numbers& second) const;
  /// Adds the light that rays meet on their way.
  void collect(const Block& b, bool from_camera) const;
  /// Puts into `wave.next_rays` where the block's paths go from points on one material; they are at `place` in the
  /// order. Light from the lamps is promised to `wave.shadows`.
  void scatter(int material, int place, int bounce, Wave& wave) const;
  /// Fetches what the light samples of a path will read, which is at a place in the order.
  void fetch(const Wave& wave, std::size_t place, int bounce, void (Lights::*what)(double) const) const;
  /// Chooses lights on one side, and directions towards them.
  void aim(bool far, int bounce, Wave& wave) const;
  /// Takes the light that aim() has found for the paths in the lanes from `first` on, and chooses where they go on, or
  /// clears `on` where they end.
  void choose(const Surface& surface, const PackedBrdf& brdf, std::size_t first, int bounce, Wave& wave,
              Lanes<bool>& on) const;

  /// Loops over a block: the rays from the camera through points of the film; random numbers; the frames of points;
  /// directions to lights into the frames; directions where paths go out of them.
  void begin(const Numbers& x, const Numbers& y, Block& b) const;
  static void random(const Block& b, std::uint64_t index, Numbers& out);
  static void make_frames(const Surface& surface, Block& b);
  static void turn_to_lights(bool far, Block& b);
  static void turn_to_world(Block& b);

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

/// Paths that take a step together, in loops over lanes.
struct PathTracer::Block {
  std::size_t count;
  Lanes<Path*> paths;
  Lanes<std::uint64_t> keys;  // of their random numbers
  Rays rays;
  Lanes<Meeting> meetings;
  Lanes<const double*> sampled;  // Path's
  Hits hits;

  // The frame: z is normal * side, and wo is in it. Of a model of two sides z is outside.
  Vectors bitangent, wo;
  Numbers side;
  /// Light from one side of the surface, the viewer's or the other.
  struct Side {
    Lanes<double*> chances;
    Lanes<bool> lit;
    Vectors facing;
    LightSamples lights;
    Vectors wi, from;  // in the frame; where the ray to the light begins
  };
  std::array<Side, 2> sides;

  // Where paths go: by which numbers, in the frame, and in the world.
  Numbers lobe, u, v;
  Vectors wi, from, out;
  Vectors normal;  // Path's
  Numbers rises;   // cosine to it
};

class PathTracer::Wave {
  friend class PathTracer;
  explicit Wave(const std::vector<Surface>& surfaces) : scratch(surfaces) {}

  std::vector<Path> paths;
  std::vector<double> chances;  // for each path, of the lights on the viewer's side of a surface and on the other
  std::vector<Path*> active, next;
  std::vector<Ray> rays, next_rays;  // of `active` and `next`
  std::vector<Meeting> meetings;
  std::vector<int> order;   // of the rays, by material
  std::vector<int> places;  // in the order, behind the last ray that leaves and that on each material
  std::unique_ptr<Block> block = std::make_unique<Block>();
  std::vector<Shadow> shadows;
  std::vector<Ray> shadow_rays;
  std::vector<std::uint8_t> hidden;
  SurfaceScratch scratch;
};

}  // namespace brdfc::reference
