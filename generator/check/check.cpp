// SPDX-License-Identifier: GPL-3.0-or-later
// Runs the checks: makes the cases, collects verdicts, and returns them as rows.
#include "check/check.h"

#include <algorithm>
#include <cmath>

#include "check/claim.h"
#include "core/text.h"
#include "measure/bound_model.h"
#include "measure/probes.h"

namespace brdfc::check {

Trial::Trial(const Model& model, const Options& options) : model_(model), seed_(options.seed), effort_(options.effort) {
  require_bound(model);
  std::vector<ParamValues> chosen =
      measure::thin_out(info(), measure::slider_cases(info(), 3, seed_), std::size_t(std::max(6, scaled(16))));
  const std::size_t usual = chosen.size();
  for (const ParamValues& v :
       measure::thin_out(info(), measure::end_cases(info(), false), std::size_t(std::max(4, scaled(16)))))
    chosen.push_back(v);
  const std::size_t stride = std::max<std::size_t>(1, chosen.size() / std::size_t(scaled(12)));
  for (std::size_t i = 0; i < chosen.size(); ++i)
    cases_.push_back({i, i < usual, i % stride == 0, measure::bind_model(model, chosen[i]), model.make_float(chosen[i]),
                      model.make_wide(chosen[i])});
}

int Trial::scaled(int n) const { return std::max(1, int(std::lround(n * effort_))); }

void Verdict::add(double value, const std::string& where, double uncertain) {
  // The uncertainty makes limits that must hold everywhere less strict, and limits that must be reached somewhere
  // stricter.
  const double slack = (limit_.at_most ? 1 : -1) * (limit_.everywhere ? 1 : -1) * uncertain;
  const double limit = limit_.value + slack, excess = limit_.at_most ? value - limit : limit - value;
  const bool passed = excess <= 0;  // a NaN fails
  const std::lock_guard lock(mutex_);
  const bool first = cases_++ == 0;
  // Keeps the worst place: the largest excess for a property that must hold everywhere, the smallest for one that must
  // show somewhere.
  const bool further = std::isnan(excess_) ? !limit_.everywhere
                       : limit_.everywhere ? !(excess <= excess_)
                                           : excess < excess_;
  if (first || further) {
    excess_ = excess;
    worst_ = value;
    limit_there_ = limit;
    where_ = where;
  }
  passed_ = first ? passed : limit_.everywhere ? passed_ && passed : passed_ || passed;
}

void Verdict::skip() {
  const std::lock_guard lock(mutex_);
  ++skipped_;
}

void Verdict::report(Row& row) const {
  row.cases = cases_;
  row.skipped = skipped_;
  row.worst = worst_;
  row.limit = cases_ == 0 ? limit_.value : limit_there_;
  row.where = where_;
  row.result = cases_ == 0 ? Result::Skipped : passed_ ? Result::Passed : Result::Failed;
  if (cases_ == 0) row.reason = "no case could be judged: quadrature did not converge, or no light is scattered";
}

std::string without_lobe(const Trial& t) { return t.model().has_scatter() ? "" : "the model has delta terms alone"; }

std::string without_upper_lobe(const Trial& t) {
  if (!t.model().has_scatter()) return without_lobe(t);
  for (const Case& c : t.cases())
    if (!c.bound.brdf->scatters_through()) return "";
  return "the lobe goes on below the surface";
}

namespace {

/// All checks, in the order of the output.
std::vector<Check> all_checks(const ModelProperties& claims) {
  std::vector<Check> all;
  for (std::vector<Check>& group :
       std::vector{value_checks(), energy_checks(claims), symmetry_checks(claims), shape_checks(claims),
                   sampling_checks(claims), closure_checks(), rounding_checks()})
    std::move(group.begin(), group.end(), std::back_inserter(all));
  return all;
}

Row run(const Check& check, const Trial& trial) {
  Row row;
  row.model = trial.info().name;
  row.check = check.name;
  row.expected = check.expected;
  row.reason = check.inapplicable(trial);
  if (!row.reason.empty()) {
    row.result = Result::Skipped;
    return row;
  }
  Verdict verdict(check.limit);
  try {
    check.judge(trial, verdict);
    verdict.report(row);
    if (row.result == Result::Failed) row.declare = check.declare;
  } catch (const ValueError& e) {
    verdict.report(row);
    row.result = Result::Failed;
    row.reason.clear();
    row.where = e.what();
  }
  return row;
}

}  // namespace

std::vector<Row> check_model(const Model& model, const Options& options) {
  const Trial trial(model, options);
  std::vector<Row> rows;
  for (const Check& check : all_checks(trial.claims())) rows.push_back(run(check, trial));
  return rows;
}

void require_vital(const Model& model) {
  const Trial trial(model, {.effort = 0.1});
  std::vector<std::string> failed;
  for (const Check& check : all_checks(trial.claims()))
    if (check.vital && run(check, trial).result == Result::Failed)
      failed.push_back(fmt::format("{} ({})", check.name, check.expected));
  if (!failed.empty())
    throw ValueError(
        fmt::format("{}: fails {}: run `brdfc check {}`", model.info().name, join(failed, ", "), model.info().name));
}

}  // namespace brdfc::check
