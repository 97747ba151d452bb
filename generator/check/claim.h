// SPDX-License-Identifier: GPL-3.0-or-later
// What a check is made of, for the files of this folder: one function a claim, which judges the cases that a model is
// tried at. To add a check: a function, and a line in its group's list.
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

/// The model with one set of parameters, in all precisions.
struct Case {
  std::size_t index = 0;
  bool within = true;     ///< the sliders' ranges: what a model declares of its lobe holds there
  bool thorough = false;  ///< one of the few that quadrature and histograms are made for, which cost most
  measure::BoundModel bound;
  std::unique_ptr<Brdf<float>> single;
  std::unique_ptr<Brdf<Wide>> wide;
};

/// The albedo towards one view, by quadrature and by the mean of samples.
struct AlbedoFound {
  double highest = 0;       ///< largest channel
  double off_one = 0;       ///< largest distance of a channel from 1
  double error = 0;         ///< of quadrature
  double table_error = 0;   ///< of tables that the model's f holds
  double difference = 0;    ///< from the mean of samples, largest channel, delta terms aside
  double sample_error = 0;  ///< standard error of that mean
  bool white = false;       ///< colours are at 1
  std::string where;
};

/// One sequence of random numbers a purpose, so that a check more or less changes no other one's.
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

/// A model and what it is tried with. Checks run one after the other, each over the cases side by side.
class Trial {
 public:
  Trial(const Model&, const Options&);
  const Model& model() const { return model_; }
  const ModelInfo& info() const { return model_.info(); }
  const ModelProperties& claims() const { return model_.info().properties; }
  /// Those within the sliders' ranges come first.
  const std::vector<Case>& cases() const { return cases_; }
  /// f(case) for every case, side by side.
  template <class F> void for_each(const F& f) const {
    for_all(cases_.size(), [&](std::size_t i) { f(cases_[i]); });
  }
  measure::Random random(const Case& c, Purpose what) const {
    return measure::Random(seed_ * 7919 + c.index * 101 + std::uint64_t(what));
  }
  measure::Random random() const { return measure::Random(seed_); }
  /// A number of directions or samples, scaled by the effort.
  int scaled(int) const;
  /// Of the views that sampling found worst, and of some others. Measured once, for several checks.
  const std::vector<AlbedoFound>& albedos() const;

 private:
  const Model& model_;
  std::uint64_t seed_;
  double effort_;
  std::vector<Case> cases_;
  mutable std::vector<AlbedoFound> albedos_;
};

/// What a value is compared with: see the functions below, which make them.
struct Limit {
  double value = 0;
  bool at_most = true;
  bool everywhere = true;  ///< else one value that keeps it is enough
};
inline Limit at_most(double x) { return {x, true, true}; }
inline Limit at_least(double x) { return {x, false, true}; }
/// A property declared absent: its violation must be at least this large somewhere.
inline Limit somewhere_at_least(double x) { return {x, false, false}; }

/// Gathers what one check finds in cases that run in parallel.
class Verdict {
 public:
  explicit Verdict(const Limit& limit) : limit_(limit) {}
  /// Judges a value. `uncertain` is how far off it may be as measured: it widens a limit on what must be kept, and
  /// hardens one on what must show.
  void add(double value, const std::string& where, double uncertain = 0);
  /// A case that could not be judged: quadrature did not converge well enough.
  void skip();
  /// A check is skipped, with a reason, where no case could be judged: that is no fault of the model.
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
  std::string expected;  ///< what is claimed, in words
  Limit limit;
  std::function<void(const Trial&, Verdict&)> judge;
  /// Why it does not apply to the model; empty where it does.
  std::string (*inapplicable)(const Trial&) = [](const Trial&) { return std::string(); };
  bool vital = false;        ///< quick, and nothing can be built of a model that fails it
  std::string declare = {};  ///< as of a Row that has failed
};
/// The check of a property of this name in ModelProperties, as it is claimed.
inline Check check_of(bool claimed, const std::string& property, Check present, Check absent) {
  Check check = std::move(claimed ? present : absent);
  check.declare = fmt::format(".{} = {}", property, !claimed);
  return check;
}
/// The same for a limit, whose claim names the place.
inline Check check_of(const std::string& claimed, const std::string& property, Check present, Check absent) {
  Check check = std::move(claimed.empty() ? absent : present);
  check.declare = fmt::format(".{} = \"{}\"", property, claimed.empty() ? "PARAMETER=VALUE" : "");
  return check;
}

/// Reasons not to judge.
std::string without_lobe(const Trial&);        ///< there are delta terms alone
std::string without_upper_lobe(const Trial&);  ///< that, or all light that is scattered may go through the surface

// The groups, a file each.
std::vector<Check> value_checks();
std::vector<Check> energy_checks(const ModelProperties&);
std::vector<Check> symmetry_checks(const ModelProperties&);
std::vector<Check> shape_checks(const ModelProperties&);
std::vector<Check> sampling_checks(const ModelProperties&);
std::vector<Check> closure_checks();
std::vector<Check> rounding_checks();

// Limits that several groups share.
/// An identity of formulas, in Wide: only constants written in double precision round.
inline constexpr double kIdentity = 1e-12;
/// A property declared absent must visibly be.
inline constexpr double kVisible = 1e-3;
/// Weights or values that are equal but for rounding.
inline constexpr double kEven = 1e-6;

}  // namespace brdfc::check
