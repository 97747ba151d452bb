// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a check, for the files of this folder: one function for each claim, which judges all cases of a model.
// To add a check, add a function and a line in its group's list.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "check/check.h"
#include "core/parallel.h"
#include "measure/bound_model.h"
#include "measure/probes.h"

namespace brdfc::check {

/// A model with one set of parameters, in all precisions.
struct Case {
  std::size_t index = 0;
  bool within = true;     ///< inside the sliders' ranges, where a model's claims about its lobe hold
  bool thorough = false;  ///< one of the few cases for quadrature and histograms, which are the slowest
  measure::BoundModel bound;
  std::unique_ptr<Brdf<float>> single;
  std::unique_ptr<Brdf<Wide>> wide;
};

/// The albedo for one view, by quadrature and as the mean of samples.
struct AlbedoFound {
  double highest = 0;        ///< largest channel
  double off_one = 0;        ///< largest distance of a channel from 1
  double error = 0;          ///< error of the quadrature
  double table_error = 0;    ///< error of tables inside the model's f
  double difference = 0;     ///< from the mean of samples, largest channel, without delta terms
  double sample_error = 0;   ///< standard error of that mean
  bool white = false;        ///< all colours are 1
  bool compensated = false;  ///< the case has the model's compensated choice
  std::string where;
};

/// Each purpose has its own sequence of random numbers, so that a new check does not change the others.
enum class Purpose : std::uint64_t {
  Values = 1,
  Albedo,
  Reciprocity,
  Weights,
  Histogram,
  Closures,
  FloatRounding,
  DoubleRounding,
  Density,
  Positive,
  Isotropy,
  Smooth,
  Spread,
  Matte,
  Mirror,
  Length,
  Horizon
};

/// A model and the cases that it is checked with. Checks run one after the other, each in parallel over the cases.
class Trial {
 public:
  Trial(const Model&, const Options&);
  const Model& model() const { return model_; }
  const ModelInfo& info() const { return model_.info(); }
  const ModelProperties& claims() const { return model_.info().properties; }
  /// The cases inside the sliders' ranges come first.
  const std::vector<Case>& cases() const { return cases_; }
  /// Calls f(case) for every case, in parallel.
  template <class F> void for_each(const F& f) const {
    for_all(cases_.size(), [&](std::size_t i) { f(cases_[i]); });
  }
  measure::Random random(const Case& c, Purpose what) const {
    return measure::Random(seed_ * 7919 + c.index * 101 + std::uint64_t(what));
  }
  measure::Random random() const { return measure::Random(seed_); }
  /// Scales a number of directions or samples by the effort.
  int scaled(int) const;
  /// Albedos of the views that sampling found worst and of some others. They are measured once, for several checks.
  const std::vector<AlbedoFound>& albedos() const;

 private:
  const Model& model_;
  std::uint64_t seed_;
  double effort_;
  std::vector<Case> cases_;
  mutable std::vector<AlbedoFound> albedos_;
};

/// The limit that a value is compared with. The functions below make limits.
struct Limit {
  double value = 0;
  bool at_most = true;
  bool everywhere = true;  ///< false: it is enough that one value satisfies the limit
};
inline Limit at_most(double x) { return {x, true, true}; }
inline Limit at_least(double x) { return {x, false, true}; }
/// For a property that is declared absent: its violation must reach x somewhere.
inline Limit somewhere_at_least(double x) { return {x, false, false}; }

/// Collects the results of one check over cases that run in parallel.
class Verdict {
 public:
  explicit Verdict(const Limit& limit) : limit_(limit) {}
  /// Judges a value. `uncertain` is the measurement error: it loosens a limit that must hold everywhere, and tightens
  /// one that must be exceeded somewhere.
  void add(double value, const std::string& where, double uncertain = 0);
  /// Counts a case that could not be judged because quadrature did not converge well enough.
  void skip();
  /// Fills in the row. If no case could be judged, the check is reported as skipped, with the reason, because that is
  /// no fault of the model.
  void report(Row&) const;

 private:
  Limit limit_;
  int cases_ = 0, skipped_ = 0;
  bool passed_ = false;
  double excess_ = 0, worst_ = 0, limit_there_ = 0;
  std::string where_;
  std::mutex mutex_;
};

struct Check {
  std::string name;
  std::string expected;  ///< the claim, in words
  Limit limit;
  std::function<void(const Trial&, Verdict&)> judge;
  /// Reason why the check does not apply to the model; empty if it applies.
  std::string (*inapplicable)(const Trial&) = [](const Trial&) { return std::string(); };
  bool vital = false;        ///< a quick check without which nothing can be built from the model
  std::string declare = {};  ///< Row::declare, if the check fails
};
/// The check for a property of this name in ModelProperties: `present` if the property is claimed, else `absent`.
inline Check check_of(bool claimed, const std::string& property, Check present, Check absent) {
  Check check = std::move(claimed ? present : absent);
  check.declare = fmt::format(".{} = {}", property, !claimed);
  return check;
}
/// The same for a limiting case; its claim names the parameter value.
inline Check check_of(const std::string& claimed, const std::string& property, Check present, Check absent) {
  Check check = std::move(claimed.empty() ? absent : present);
  check.declare = fmt::format(".{} = \"{}\"", property, claimed.empty() ? "PARAMETER=VALUE" : "");
  return check;
}

/// Reasons why a check does not apply; empty if it applies.
std::string without_lobe(const Trial&);        ///< the model has delta terms only
std::string without_upper_lobe(const Trial&);  ///< as above, or all scattered light may be transmitted

// The groups of checks, one file each.
std::vector<Check> value_checks();
std::vector<Check> energy_checks(const ModelProperties&);
std::vector<Check> symmetry_checks(const ModelProperties&);
std::vector<Check> shape_checks(const ModelProperties&);
std::vector<Check> sampling_checks(const ModelProperties&);
std::vector<Check> closure_checks();
std::vector<Check> rounding_checks();

// Limits that several groups use.
/// Limit for identities between formulas, evaluated in Wide: the only rounding is that of constants written in double
/// precision.
inline constexpr double kIdentity = 1e-12;
/// Smallest violation that counts as visible, for a property that is declared absent.
inline constexpr double kVisible = 1e-3;
/// Limit for weights or values that are equal up to rounding.
inline constexpr double kEven = 1e-6;

}  // namespace brdfc::check
