// SPDX-License-Identifier: GPL-3.0-or-later
// The reference renderer. Embree intersects rays with triangles; everything else is computed in double precision.
//
// Conventions. A path scatters at most max_bounces + 1 times. After the last scattering it still collects directly
// visible light, as in Cycles. Surfaces have two equal sides: normals are turned towards the viewer. Shading uses the
// interpolated normal, bent where the mirror direction about it would be below the surface. A viewer below its horizon
// is raised to it (model/horizon.h). Light from below the geometric surface contributes nothing. The tangent is the
// object's z axis made orthogonal to the normal, or its x axis if those are parallel; the bitangent is normal x
// tangent. A pixel is the mean over its own square.
#pragma once

#include <atomic>
#include <functional>

#include "reference/image.h"
#include "reference/scene.h"

namespace brdfc::reference {

/// Where paths begin. All give the same mean, except LampsSwapped.
enum class Origin {
  Camera,
  Lamps,         ///< see light_tracer.h
  LampsSwapped,  ///< as Lamps, with the BRDF's directions swapped: wrong unless the BRDF is reciprocal
};

struct Progress {
  double fraction = 0;  ///< of the samples that are done
  int samples = 0, spp = 0;
  double seconds = 0, seconds_left = 0;
  double paths_per_second = 0;
};

struct RenderOptions {
  RenderSettings settings;
  Origin origin = Origin::Camera;
  int threads = 0;         ///< 0: all cores
  double max_seconds = 0;  ///< 0: no limit; else stops early, after at least one sample per pixel
  int wave = 0;            ///< paths traced together; 0: a fast number. Does not change the picture
  /// Limit for triangles in copies of meshes, which make rays faster. Beyond it, equal meshes are stored once
  /// (reference/tracer.h).
  std::size_t most_copies = kMostCopies;
  std::size_t most_weighed = kMostWeighed;        ///< up to this number each lamp gets a weight, else a tree chooses
  const std::atomic<bool>* cancel = nullptr;      ///< set by any thread: stop soon and keep the result so far
  std::function<void(const Progress&)> progress;  ///< called from time to time, by the calling thread
};

struct RenderResult {
  /// Its metadata: scene, scene_hash, seed, samples (the least over the pixels), samples_max, seconds, seconds_tracing
  /// (without the time before the first path), max_bounces, threads, version. It has no variance layer if a pixel has
  /// less than two samples.
  Rendering rendering;
  int samples = 0;  ///< the least over the pixels
  double seconds = 0;
  double paths_per_second = 0;
  bool cancelled = false;
};

/// Renders a scene. Throws ValueError that names model, parameters, directions and value if a model returns a value
/// that is negative or not finite.
RenderResult render(const Scene& scene, const RenderOptions& options);

}  // namespace brdfc::reference
