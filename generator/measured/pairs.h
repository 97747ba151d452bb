// SPDX-License-Identifier: GPL-3.0-or-later
// Pairs of directions at which models are compared with measured data, and how much light a fit misplaces there.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <vector>

#include "measured/measured_model.h"

namespace brdfc::measured {

using Colors = std::vector<Rgb<double>>;

/// Pairs of directions, and the data there; `weight` makes a sum an integral over both hemispheres of f cos cos.
struct Pairs {
  std::vector<Vec3<double>> wi, wo;
  Eigen::VectorXd weight;
  Colors data;
  double light = 0;  ///< the sum of weight * data
};
/// About `count` pairs: views by the cosine, lights as the data reflect.
Pairs make_pairs(const MeasuredModel& data, std::size_t count, std::uint64_t seed);

/// The sum of weight |f - data|, divided by the light.
double error_of(const Pairs&, const Colors& f);

inline double channel(const Rgb<double>& c, std::size_t i) { return i == 0 ? c.r : i == 1 ? c.g : c.b; }
inline void set_channel(Rgb<double>& c, std::size_t i, double v) { (i == 0 ? c.r : i == 1 ? c.g : c.b) = v; }

}  // namespace brdfc::measured
