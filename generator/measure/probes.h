// SPDX-License-Identifier: GPL-3.0-or-later
// Random directions and parameters, and relative differences, for the checks.
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "core/vec.h"
#include "model/model.h"

namespace brdfc::measure {

/// The random number generator of all checks. It is seeded, so that checks are repeatable.
using Random = std::mt19937_64;

double uniform(Random&);                  ///< in [0, 1)
Vec3<double> uniform_direction(Random&);  ///< above the surface, uniform in solid angle
Vec3<double> uniform_cube(Random&);       ///< three numbers for sample()

/// True if the model also has values for a viewer below the surface.
template <class T> bool two_sided(const Model& model, const Brdf<T>& brdf) {
  return model.has_transmit() || brdf.scatters_through();
}

/// |a - b| divided by the larger magnitude; 0 if both are zero. For colours, the largest of the channels.
template <class T> double relative(const T& a, const T& b) {
  const T scale = maximum(T(abs(a)), T(abs(b)));
  return scale > T(0) ? double(T(abs(T(a - b))) / scale) : 0;
}
template <class T> double relative(const Rgb<T>& a, const Rgb<T>& b) {
  return std::max({relative(a.r, b.r), relative(a.g, b.g), relative(a.b, b.b)});
}

/// Converts to double precision.
template <class T> Rgb<double> to_double(const Rgb<T>& c) { return {double(c.r), double(c.g), double(c.b)}; }
template <class T> Vec3<double> to_double(const Vec3<T>& v) { return {double(v.x), double(v.y), double(v.z)}; }

/// The value for tests of rounding and symmetry: f, or, for a model with delta terms only, the weight of the delta term
/// on wi's side.
template <class T> Rgb<T> value_of(const Model& model, const Brdf<T>& brdf, const Vec3<T>& wi, const Vec3<T>& wo) {
  if (model.has_scatter()) return brdf.eval(wi, wo);
  return (wi.z > T(0)) == (wo.z > T(0)) ? brdf.mirror(wo) : brdf.transmit(wo);
}

/// `count` pairs of unit directions (wi, wo): uniform ones, ones into which the model scatters, and ones where formulas
/// tend to break, which are the normal, grazing, mirror and backscattering directions.
std::vector<std::array<Vec3<double>, 2>> direction_pairs(const Brdf<double>&, int count, Random&,
                                                         bool two_sided = false);

/// `choices`, with numbers and colours drawn uniformly from the sliders' ranges; on a logarithmic scale if the schema
/// says so.
ParamValues random_values(const ModelInfo&, ParamValues choices, Random&);
/// For every combination of choices: the defaults, and `random` results of random_values().
std::vector<ParamValues> slider_cases(const ModelInfo&, int random, std::uint64_t seed);
/// With the default choices: every number at both ends of its range and every colour at 0 and 1, one by one and all
/// together.
std::vector<ParamValues> end_cases(const ModelInfo&, bool sliders);
/// A selection of at most `most` of these values. The first ones cover as many pairs of choices as possible.
std::vector<ParamValues> thin_out(const ModelInfo&, const std::vector<ParamValues>&, std::size_t most);

}  // namespace brdfc::measure
