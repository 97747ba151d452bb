// SPDX-License-Identifier: GPL-3.0-or-later
// Emission sampling: rays that leave lamps and the environment.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "reference/lights.h"
#include "reference/scene.h"
#include "reference/tracer.h"

namespace brdfc::reference {

/// A ray that carries light. Power 0 means that there is no ray.
struct EmittedRay {
  Vec3<double> origin, direction;  ///< direction is a unit vector
  Rgb<double> power{0, 0, 0};  ///< watts; mean: total power of lamps, and of distant light the power through the bounds
};

class Emitter {
 public:
  /// `bounds` contains all surfaces. Distant light is aimed at it.
  Emitter(const Scene& scene, const Sphere& bounds);

  bool empty() const { return chances_.empty(); }
  /// Samples a ray with random numbers in [0, 1): for the choice of the lamp, the point on it and the direction.
  EmittedRay emit(double choice, const std::array<double, 3>& where, const std::array<double, 2>& way) const;

 private:
  /// Makes a ray through the bounds from a direction of distant light and its pdf per solid angle.
  EmittedRay from_far(const Vec3<double>& direction, const Rgb<double>& radiance, double pdf,
                      const std::array<double, 2>& disk) const;

  const Scene& scene_;
  const Sphere bounds_;
  std::unique_ptr<EnvironmentSampler> image_;
  std::vector<double> chances_, ends_;  // probabilities of the lamps, then of the environment; running sums of these
};

}  // namespace brdfc::reference
