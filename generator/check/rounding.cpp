// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the rounding errors of formulas in float and double.
#include "check/claim.h"
#include "measure/stability.h"

namespace brdfc::check {
namespace {

/// The rounding error that a good formula may add to that of its inputs, in units of the latter.
constexpr double kAmplified = 32;

void add(const measure::Stability& s, Verdict& verdict) {
  verdict.add(s.amplified, fmt::format("{} (largest relative error {:.2g})", s.amplified_where, s.relative));
}

void single(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    add(measure::float_stability(t.model(), c.bound.values, t.scaled(128), t.random(c, Purpose::FloatRounding)()),
        verdict);
  });
}

void twice(const Trial& t, Verdict& verdict) {
  t.for_each([&](const Case& c) {
    add(measure::double_stability(t.model(), c.bound.values, t.scaled(48), t.random(c, Purpose::DoubleRounding)()),
        verdict);
  });
}

}  // namespace

std::vector<Check> rounding_checks() {
  constexpr const char* kExpected = "error of f / error its inputs' rounding causes";
  return {{"float rounding", kExpected, at_most(kAmplified), single},
          {"double rounding", kExpected, at_most(kAmplified), twice}};
}

}  // namespace brdfc::check
