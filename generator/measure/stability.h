// SPDX-License-Identifier: GPL-3.0-or-later
// Rounding errors of the models' formulas: measured against a wider type, with what rounding the inputs causes divided
// out, and hunted for.
//
// A direction stands for the unit vector nearest to it: the wider type evaluates the normalised one. So a formula that
// takes sin theta from sqrt(1 - cos^2 theta) near the normal is charged for the digits it loses.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "measure/probes.h"

namespace brdfc::measure {

/// How far a scalar type strays from a wider one. `amplified` is the relative error of eval() in units of
/// epsilon (1 + condition), where the condition is the sum over all inputs (components of the directions, renormalised,
/// and numbers) of the relative change of f for a relative change of the input.
struct Stability {
  double relative = 0;          ///< largest relative error of f
  double amplified = 0;         ///< largest of what the text above says; about 1 for a formula that loses nothing
  std::string where;            ///< parameters and directions of the largest relative error
  std::string amplified_where;  ///< and of the largest amplified one
  long points = 0;              ///< pairs of directions looked at
};
/// float against double, or double against Wide, for one set of parameters and directions as direction_pairs gives.
Stability float_stability(const Model&, const ParamValues&, int points, std::uint64_t seed);
Stability double_stability(const Model&, const ParamValues&, int points, std::uint64_t seed);

/// double against Wide over everything a model accepts: parameters and angles uniform in the ordinals of floating-point
/// numbers, half of them in the sliders' ranges; stiff places (grazing, normal, mirror and backscattering directions
/// and close to them, ends of ranges); then hill climbing from the worst places found.
struct Hunt {
  long points = 20000;     ///< random and stiff places to begin with
  int climbs = 4;          ///< hill climbings, from as many of the worst places
  int steps = 120;         ///< of a climb
  std::uint64_t seed = 1;  ///< the same one gives the same hunt
};
Stability hunt_rounding(const Model&, const Hunt&);

/// Evaluates eval(), pdf() and sample() in double and float as often as asked at inputs as above, u = 0 and 1 - ulp
/// among them. Throws ValueError at the first value that is NaN, infinite or negative. Returns the number of calls.
long evaluate_everywhere(const Model&, long calls, std::uint64_t seed);

/// Relative L1 error over the model's own samples of float, and of the recorded program executed in float, against
/// double, by decade of the largest Number parameter; `inherent` is what rounding the directions to float does to f in
/// double.
struct SinglePrecision {
  double native = 0, recorded = 0, inherent = 0;  ///< the largest of each among the cases
  std::string where;                              ///< the case of the largest of `native` and `recorded`
  int cases = 0;                                  ///< sets of parameters in this decade
};
std::map<int, SinglePrecision> single_precision_by_decade(const Model&, int cases, int samples, std::uint64_t seed);

}  // namespace brdfc::measure
