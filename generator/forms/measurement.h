// SPDX-License-Identifier: GPL-3.0-or-later
// What is known about a form before rendering: its error against the model, its cost, and its fit.
#pragma once

#include <optional>
#include <string>

#include "fit/fit.h"
#include "forms/setting.h"
#include "model/model.h"

namespace brdfc::forms {

/// The measured error of a form against the model.
struct FormError {
  std::optional<double>
      relative_l1;  ///< of f cos over directions and parameters; none if the form equals the model only in expectation
  std::optional<double> relative_l2;  ///< the same in the L2 norm
  double albedo = 0;                  ///< largest |albedo - quadrature|, executed in single precision
  std::string note;
  ParamValues at = {};  ///< the error is known for these values alone, of parameters that the form leaves open
};

class Measurement {
 public:
  virtual ~Measurement() = default;

  /// Executes the form in single precision at random parameters and directions, which are the same in every run. For a
  /// fit at the fixed values: the mean over its axis and over views with evenly spaced cosines; `note` names the worst
  /// view. Throws ValueError with model, parameters, directions and value for a result that is NaN, infinite or
  /// negative.
  virtual FormError error(const Model&, const Setting&) const = 0;
  /// For a form that a budget may choose: the mean relative L1 error over views, at this value of the fit's axis, or at
  /// the worst value if none is given.
  virtual std::optional<double> off_by(const Model&, const Setting&, const std::optional<double>& /*axis*/) const {
    return {};
  }
  /// How lamps without size shine on the form, as a clause, for a scene with this many of them and up to `slots` aimed
  /// lamps; empty if as on Blender's own nodes. Measured by evidence/conditions.
  virtual std::string under_sizeless_lamps(int /*lamps*/, int /*slots*/) const { return {}; }
  /// True if the costs that evidence/bench measures apply to the form with this setting.
  virtual bool cost_is_measured(const Setting&) const { return true; }
  /// The fit that provides its closures, made at first use; nullptr for a form without tables of its own.
  virtual const fit::Fit* fit(const Model&, const Setting&) const { return nullptr; }
  /// The parameter that the fit runs along, if any.
  virtual std::optional<fit::FitAxis> axis(const Model&, const Setting&) const = 0;
  /// Makes or reads the fit, so that later calls of fit() take no time.
  virtual void prepare(const Model& model, const Setting& setting) const { fit(model, setting); }
};

}  // namespace brdfc::forms
