// SPDX-License-Identifier: GPL-3.0-or-later
// Random directions, parameters and differences that the checks share.
#pragma once

#include <algorithm>
#include <array>
#include <random>
#include <string>
#include <vector>

#include "core/vec.h"
#include "model/model.h"

namespace brdfc::measure {

/// The generator that all checks draw from: seeded, so that they repeat.
using Random = std::mt19937_64;

double uniform(Random&);                  ///< in [0, 1)
Vec3<double> uniform_direction(Random&);  ///< above the surface, uniform in solid angle
Vec3<double> uniform_cube(Random&);       ///< three numbers for sample()

/// Has the model values for a viewer below the surface too?
template <class T> bool two_sided(const Model& model, const Brdf<T>& brdf) {
  return model.has_transmit() || brdf.scatters_through();
}

/// |a - b| over the larger of both, 0 for two zeros; the largest of the channels.
template <class T> double relative(const T& a, const T& b) {
  const T scale = maximum(T(abs(a)), T(abs(b)));
  return scale > T(0) ? double(T(abs(T(a - b))) / scale) : 0;
}
template <class T> double relative(const Rgb<T>& a, const Rgb<T>& b) {
  return std::max({relative(a.r, b.r), relative(a.g, b.g), relative(a.b, b.b)});
}

/// The same in double precision.
template <class T> Rgb<double> to_double(const Rgb<T>& c) { return {double(c.r), double(c.g), double(c.b)}; }
template <class T> Vec3<double> to_double(const Vec3<T>& v) { return {double(v.x), double(v.y), double(v.z)}; }

/// The value that rounding and symmetries are measured on: f, or for a model of delta terms alone the weight of the one
/// on wi's side.
template <class T> Rgb<T> value_of(const Model& model, const Brdf<T>& brdf, const Vec3<T>& wi, const Vec3<T>& wo) {
  if (model.has_scatter()) return brdf.eval(wi, wo);
  return (wi.z > T(0)) == (wo.z > T(0)) ? brdf.mirror(wo) : brdf.transmit(wo);
}

/// `count` pairs of unit directions (wi, wo): anywhere, where the model scatters to, and where formulas break: the
/// normal, grazing, mirror and backscattering directions.
std::vector<std::array<Vec3<double>, 2>> direction_pairs(const Brdf<double>&, int count, Random&,
                                                         bool two_sided = false);

/// `choices`, and numbers and colours drawn uniformly within the sliders' ranges; by factors where the schema says so.
ParamValues random_values(const ModelInfo&, ParamValues choices, Random&);
/// For every combination of choices the defaults and `random` draws of random_values().
std::vector<ParamValues> slider_cases(const ModelInfo&, int random, std::uint64_t seed);
/// With the default choices, every number at both ends of a range and colours at 0 and 1, one by one and all together.
std::vector<ParamValues> end_cases(const ModelInfo&, bool sliders);
/// At most `most` of these values: the first ones cover every pair of choices as far as possible.
std::vector<ParamValues> thin_out(const ModelInfo&, const std::vector<ParamValues>&, std::size_t most);

}  // namespace brdfc::measure
