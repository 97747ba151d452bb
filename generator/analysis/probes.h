// SPDX-License-Identifier: GPL-3.0-or-later
// Random directions and parameters that the checks share.
#pragma once

#include <array>
#include <random>
#include <string>
#include <vector>

#include "analysis/albedo.h"

namespace brdfc {

using Random = std::mt19937_64;

double uniform(Random&);                  ///< in [0, 1)
Vec3<double> uniform_direction(Random&);  ///< above the surface, uniform in solid angle
Vec3<double> uniform_cube(Random&);       ///< three numbers for sample()

/// Are views from inside meant?
bool two_sided(const Model&, const Brdf<double>&);

/// What rounding and symmetries are judged by: f, or the weight of the term on wi's side where there are delta
/// terms alone.
template <class T> Rgb<T> value_of(const Model& model, const Brdf<T>& brdf, const Vec3<T>& wi, const Vec3<T>& wo) {
  if (model.has_scatter()) return brdf.eval(wi, wo);
  return (wi.z > T(0)) == (wo.z > T(0)) ? brdf.mirror(wo) : brdf.transmit(wo);
}

/// "(x, y, z)" for messages.
std::string text(const Vec3<double>&);

/// Pairs of directions (wi, wo): anywhere, where the model scatters to, and where formulas break: the normal, grazing,
/// mirror and backscattering directions.
std::vector<std::array<Vec3<double>, 2>> direction_pairs(const Brdf<double>&, int count, Random&,
                                                         bool two_sided = false);

/// For every combination of choices the defaults and `random` draws (log-uniform where a range spans decades) within
/// the sliders' ranges.
std::vector<ParamValues> slider_cases(const ModelInfo&, int random, std::uint64_t seed);
/// With the default choices, every number at both ends of a range and colours at 0 and 1, one by one and all together.
std::vector<ParamValues> end_cases(const ModelInfo&, bool sliders);
/// At most `most` of them: the first ones cover every pair of choices as far as possible.
std::vector<ParamValues> thin_out(const ModelInfo&, const std::vector<ParamValues>&, std::size_t most);

}  // namespace brdfc
