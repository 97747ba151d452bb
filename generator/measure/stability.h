// SPDX-License-Identifier: GPL-3.0-or-later
// Rounding errors of the models' formulas. They are measured against a wider type, divided by the effect of rounding
// the inputs, and searched for their maximum.
//
// A direction represents the nearest unit vector: the wider type evaluates the normalised direction. A formula that
// computes sin theta as sqrt(1 - cos^2 theta) near the normal is therefore charged for the digits that it loses.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "measure/probes.h"

namespace brdfc::measure {

/// Error of a scalar type against a wider one. `amplified` is the relative error of eval() in units of epsilon (1 +
/// condition). The condition is the sum over all inputs (components of the directions, renormalised, and numbers) of
/// the relative change of f for a relative change of the input.
struct Stability {
  double relative = 0;          ///< largest relative error of f
  double amplified = 0;         ///< largest error as defined above; about 1 for a formula without loss of digits
  std::string where;            ///< parameters and directions of the largest relative error
  std::string amplified_where;  ///< the same for the largest amplified error
  long points = 0;              ///< number of pairs of directions
};
/// float against double, or double against Wide, for one set of parameters and the directions of direction_pairs().
Stability float_stability(const Model&, const ParamValues&, int points, std::uint64_t seed);
Stability double_stability(const Model&, const ParamValues&, int points, std::uint64_t seed);

/// double against Wide over all inputs that a model accepts. The search starts with parameters and angles that are
/// uniform in the ordinals of floating-point numbers, half of them in the sliders' ranges, and with stiff places:
/// grazing, normal, mirror and backscattering directions and their neighbourhoods, and the ends of ranges. It continues
/// by hill climbing from the worst places.
struct Hunt {
  long points = 20000;     ///< number of random and stiff places to start with
  int climbs = 4;          ///< number of hill climbs, each from one of the worst places
  int steps = 120;         ///< steps of each climb
  std::uint64_t seed = 1;  ///< equal seeds give equal results
};
Stability hunt_rounding(const Model&, const Hunt&);

/// Calls eval(), pdf() and sample() in double and float `calls` times, with inputs as above, including u = 0 and 1 -
/// ulp. Throws ValueError at the first value that is NaN, infinite or negative. Returns the number of calls.
long evaluate_everywhere(const Model&, long calls, std::uint64_t seed);

/// Relative L1 error in float against double, over the model's own samples, by decade of the largest Number parameter.
/// `native` is the model in float, `recorded` the recorded program executed in float, and `inherent` the change of f in
/// double if the directions are rounded to float.
struct SinglePrecision {
  double native = 0, recorded = 0, inherent = 0;  ///< largest of all cases
  std::string where;                              ///< the case with the largest of `native` and `recorded`
  int cases = 0;                                  ///< sets of parameters in this decade
};
std::map<int, SinglePrecision> single_precision_by_decade(const Model&, int cases, int samples, std::uint64_t seed);

}  // namespace brdfc::measure
