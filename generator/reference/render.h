// SPDX-License-Identifier: GPL-3.0-or-later
// The reference path tracer: Embree finds the triangles, everything else is double precision.
//
// Conventions. A path scatters at most max_bounces + 1 times; after the last one it still collects what shines
// directly, as in Cycles. Surfaces have two equal sides: normals are turned towards the viewer. Shading uses the
// interpolated normal, bent where the mirror direction about it would be below the surface; a viewer below its horizon
// is raised to it (model/horizon.h). Light from below the geometric surface contributes nothing. The tangent is the
// object's z axis made orthogonal to the normal, or its x axis where those are parallel, and the bitangent is normal x
// tangent. A pixel is the mean over its own square.
#pragma once

#include <atomic>
#include <functional>

#include "reference/image.h"
#include "reference/scene.h"

namespace brdfc::reference {

/// Where paths begin; all give the same mean, but for LampsSwapped.
enum class Origin {
  Camera,
  Lamps,         ///< see light_tracer.h
  LampsSwapped,  ///< as Lamps, with the roles of the BRDF's directions swapped: wrong unless it is reciprocal
};

struct Progress {
  double fraction = 0;  ///< of the samples
  int samples = 0, spp = 0;
  double seconds = 0, seconds_left = 0;
  double paths_per_second = 0;
};

struct RenderOptions {
  RenderSettings settings;
  Origin origin = Origin::Camera;
  int threads = 0;         ///< 0: all cores
  double max_seconds = 0;  ///< 0: no limit; else stops early, after at least one sample a pixel
  int wave = 0;            ///< paths followed together; 0: as many as is fast. Changes no picture
  /// Triangles that may be copies, so that rays are quick; with more, equal meshes are stored once
  /// (reference/tracer.h).
  std::size_t most_copies = kMostCopies;
  std::size_t most_weighed = kMostWeighed;        ///< lamps of which each is weighed; of more a tree chooses
  const std::atomic<bool>* cancel = nullptr;      ///< set from anywhere: stop soon and keep what is done
  std::function<void(const Progress&)> progress;  ///< called now and then, from the calling thread
};

struct RenderResult {
  /// Metadata: scene, scene_hash, seed, samples (least over the pixels), samples_max, seconds, seconds_tracing
  /// (without what comes before the first path), max_bounces, threads, version. The variance layer is absent if a pixel
  /// has less than two samples.
  Rendering rendering;
  int samples = 0;  ///< least over the pixels
  double seconds = 0;
  double paths_per_second = 0;
  bool cancelled = false;
};

/// Throws ValueError naming model, parameters, directions and value if a model gives a value that is negative
/// or not finite.
RenderResult render(const Scene& scene, const RenderOptions& options);

}  // namespace brdfc::reference
