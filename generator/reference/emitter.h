// SPDX-License-Identifier: GPL-3.0-or-later
// Rays that leave lamps and the environment.
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "reference/lights.h"
#include "reference/scene.h"
#include "reference/tracer.h"

namespace brdfc::reference {

/// A ray that carries light. No power: none.
struct EmittedRay {
  Vec3<double> origin, direction;  ///< direction is a unit vector
  Rgb<double> power{0, 0, 0};      ///< watts; its mean is all that lamps send, and of what is far what meets the bounds
};

class Emitter {
 public:
  /// `bounds` holds all surfaces: what comes from far is aimed at it.
  Emitter(const Scene& scene, const Sphere& bounds);

  bool empty() const { return chances_.empty(); }
  /// A ray by random numbers in [0, 1): which lamp, where on it, and which way.
  EmittedRay emit(double choice, const std::array<double, 3>& where, const std::array<double, 2>& way) const;

 private:
  /// A direction from far and its density per solid angle become a ray through the bounds.
  EmittedRay from_far(const Vec3<double>& direction, const Rgb<double>& radiance, double pdf,
                      const std::array<double, 2>& disk) const;

  const Scene& scene_;
  const Sphere bounds_;
  std::unique_ptr<EnvironmentSampler> image_;
  std::vector<double> chances_, ends_;  // of the lamps, then of the environment; their sums up to each of them
};

}  // namespace brdfc::reference
