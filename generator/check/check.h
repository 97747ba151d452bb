// SPDX-License-Identifier: GPL-3.0-or-later
// Tries to prove every property that a model declares, for any registered model, with fixed seeds.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::check {

enum class Result {
  Passed,
  Failed,
  Skipped,  ///< nothing was judged: the check does not apply to the model, or quadrature converged at no case
};

/// Outcome of one check of one model over all cases.
struct Row {
  std::string model;
  std::string check;
  std::string expected;  ///< the limit in words, "<= 1 + error"
  int cases = 0;         ///< that were judged
  int skipped = 0;       ///< where quadrature did not converge well enough to judge
  double worst = 0;      ///< value nearest to failing, or beyond
  double limit = 0;      ///< what it is compared with
  Result result = Result::Passed;
  std::string where;   ///< parameters and directions of the worst value
  std::string reason;  ///< why the check was skipped, else empty
  /// What info() has to declare if a failure is meant, ".smooth = false"; empty where it is a fault whatever is
  /// declared, and where the check has not failed.
  std::string declare;
};

struct Options {
  std::uint64_t seed = 1;
  double effort = 1;  ///< scales the numbers of cases, directions and samples
};
/// Rows for one model: what it declares, tried at defaults, random and extreme parameters, and what every model must
/// keep. A property declared absent must visibly be absent somewhere. A value that is NaN, infinite or negative fails
/// every check that meets it, with model, parameters, directions and value in `where`. Throws as require_bound().
std::vector<Row> check_model(const Model&, const Options& = {});

/// A glance at what nothing can be built without. Throws ValueError that names the model, the checks that fail and the
/// command that says more.
void require_vital(const Model&);

}  // namespace brdfc::check
