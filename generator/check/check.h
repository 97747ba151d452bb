// SPDX-License-Identifier: GPL-3.0-or-later
// Checks, for any registered model, every property that the model declares. Seeds are fixed.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::check {

enum class Result {
  Passed,
  Failed,
  Skipped,  ///< not judged: the check does not apply, or quadrature converged for no case
};

/// Outcome of one check of one model over all cases.
struct Row {
  std::string model;
  std::string check;
  std::string expected;  ///< the limit in words, "<= 1 + error"
  int cases = 0;         ///< number of cases that were judged
  int skipped = 0;       ///< number of cases where quadrature did not converge well enough to judge
  double worst = 0;      ///< value nearest to failing, or that fails most
  double limit = 0;      ///< limit that `worst` is compared with
  Result result = Result::Passed;
  std::string where;   ///< parameters and directions of the worst value
  std::string reason;  ///< why the check was skipped, else empty
  /// If the check failed: the declaration in info() under which the behaviour is intended, such as ".smooth = false".
  /// Empty if the check passed, or if the failure is a fault under any declaration.
  std::string declare;
};

struct Options {
  std::uint64_t seed = 1;
  double effort = 1;  ///< factor on the numbers of cases, directions and samples
};
/// Checks one model with default, random and extreme parameters, and returns a row for each check: the properties that
/// the model declares, and those that every model must have. A property that is declared absent must be violated
/// visibly somewhere. A value that is NaN, infinite or negative fails every check that meets it; `where` then names
/// model, parameters, directions and value. Throws as require_bound().
std::vector<Row> check_model(const Model&, const Options& = {});

/// Checks quickly the properties without which nothing can be built. Throws ValueError that names the model, the checks
/// that failed and the command that says more.
void require_vital(const Model&);

}  // namespace brdfc::check
