// SPDX-License-Identifier: GPL-3.0-or-later
// The path tracer: paths from the camera, many at a time.
//
// The paths of a wave advance together. In each step their rays are traced in packets; then the paths scatter, in
// blocks, one material after the other; then the shadow rays are traced. Paths are independent: the light of a path is
// the same to the last bit, whatever else is in the wave.
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

  /// The start of a path: sample number `sample` of a pixel.
  struct Start {
    int x, y, sample;
  };
  /// Working memory of a thread.
  class Wave;
  Wave make_wave() const;

  /// Computes the light that each path carries to the camera.
  void follow(std::span<const Start> starts, Wave& wave, std::span<Rgb<double>> light) const;

 private:
  struct Path;
  struct Shadow;
  struct Block;

  /// Sorts the rays: first those that leave the scene, then those on each material.
  void sort_by_material(Wave& wave) const;
  /// Copies active paths and their rays into the block: those at places [from, end) of the order.
  void gather(int from, int end, Wave& wave) const;
  /// Draws one or two random numbers of a dimension for each path.
  void draw(const Block& b, std::uint64_t dimension, Numbers& first) const;
  void draw(const Block& b, std::uint64_t dimension, Numbers& first, Numbers& second) const;
  /// Adds the light of lamps and the environment that rays meet.
  void collect(const Block& b, bool from_camera) const;
  /// Scatters the block's paths on one material, at `place` in the order, and adds their new rays to `wave.next_rays`.
  /// Light from lamps is added to `wave.shadows`, until shadow rays tell whether it arrives.
  void scatter(int material, int place, int bounce, Wave& wave) const;
  /// Prefetches what the light samples of the path at a place in the order will read.
  void fetch(const Wave& wave, std::size_t place, int bounce, void (Lights::*what)(double) const) const;
  /// Samples lights on one side of the surface.
  void aim(bool far, int bounce, Wave& wave) const;
  /// Evaluates the light samples of aim() for the lanes from `first` on, and samples the directions in which the paths
  /// continue. Clears `on` for paths that end.
  void choose(const Surface& surface, const PackedBrdf& brdf, std::size_t first, int bounce, Wave& wave,
              Lanes<bool>& on) const;

  /// Loops over a block: camera rays through points of the film; random numbers; normals, bent where model/horizon.h
  /// says so; the shading frames of points; directions to lights, into the frames; sampled directions, out of the
  /// frames.
  void begin(const Numbers& x, const Numbers& y, Block& b) const;
  static void random(const Block& b, std::uint64_t index, Numbers& out);
  static void bend_normals(Block& b);
  static void make_frames(bool two_sided, Block& b);
  static void turn_to_lights(bool far, Block& b);
  static void turn_to_world(Block& b);

  /// The MIS weight (power heuristic); 1 if only one strategy is used.
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

/// The state of a path.
struct PathTracer::Path {
  PathSampler random;
  Vec3<double> normal;              // at the last scattering event, on the side of the ray
  double scattered_pdf = 0;         // pdf of the direction, if light sampling could have found it, too
  const double* sampled = nullptr;  // the probabilities of light sampling there
  Rgb<double> light{0, 0, 0}, throughput{1, 1, 1};

  explicit Path(const PathSampler& r) : random(r) {}
};

/// Light that a path receives if its shadow ray is not blocked.
struct PathTracer::Shadow {
  Path* path;
  Rgb<double> light;
};

/// Paths that advance together, in loops over lanes.
struct PathTracer::Block {
  std::size_t count;
  Lanes<Path*> paths;
  Lanes<std::uint64_t> keys;  // keys of their random numbers
  Rays rays;
  Lanes<Meeting> meetings;
  Lanes<const double*> sampled;  // as in Path
  Hits hits;

  // The shading frame: z is normal * side, and wo is given in it. For a two-sided model z points outside.
  Vectors bitangent, wo;
  Numbers side;
  /// Light samples on one side of the surface: the viewer's or the other one.
  struct Side {
    Lanes<double*> chances;
    Lanes<bool> lit;
    Vectors facing;
    LightSamples lights;
    Vectors wi, from;  // direction in the frame; origin of the shadow ray
  };
  std::array<Side, 2> sides;

  // Continuation of the paths: random numbers, direction in the frame, and origin and direction in world space.
  Numbers lobe, u, v;
  Vectors wi, from, out;
  Vectors normal;  // as in Path
  Numbers rises;   // cosine between `normal` and the new direction
};

class PathTracer::Wave {
  friend class PathTracer;
  explicit Wave(const std::vector<Surface>& surfaces) : scratch(surfaces) {}

  std::vector<Path> paths;
  std::vector<double> chances;  // for each path: of lights on the viewer's side, then on the other side
  std::vector<Path*> active, next;
  std::vector<Ray> rays, next_rays;  // rays of `active` and of `next`
  std::vector<Meeting> meetings;
  std::vector<int> order;   // indices of rays, sorted by material
  std::vector<int> places;  // ends in the order: of the rays that leave the scene, then of those on each material
  std::unique_ptr<Block> block = std::make_unique<Block>();
  std::vector<Shadow> shadows;
  std::vector<Ray> shadow_rays;
  std::vector<std::uint8_t> hidden;
  SurfaceScratch scratch;
};

}  // namespace brdfc::reference
