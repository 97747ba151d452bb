// SPDX-License-Identifier: GPL-3.0-or-later
// What is known of a form before anything is rendered: its error against the model, and what it is fitted with.
#pragma once

#include <optional>
#include <string>

#include "fit/fit.h"
#include "forms/setting.h"
#include "model/model.h"

namespace brdfc::forms {

/// The measured error of a form against the model.
struct FormError {
  std::optional<double> relative_l1;  ///< of f cos over directions and parameters; none if equal in expectation only
  std::optional<double> relative_l2;  ///< the same, root of the sums of squares
  double albedo = 0;                  ///< largest |albedo - quadrature| as executed in single precision
  std::string note;
};

class Measurement {
 public:
  virtual ~Measurement() = default;

  /// Executes the form in single precision at random parameters and directions, always the same; or says what is known
  /// of a fit at the fixed values: mean over views with cosines spread evenly and over its axis, the worst in `note`.
  /// Throws ValueError naming model, parameters, directions and value for one that is NaN, infinite or negative.
  virtual FormError error(const Model&, const Setting&) const = 0;
  /// Of a form that a budget may take: relative L1, mean over views, at this value of the fit's axis, or at the worst.
  virtual std::optional<double> off_by(const Model&, const Setting&, const std::optional<double>& /*axis*/) const {
    return {};
  }
  /// How lamps without a size shine on it, as the rest of a sentence, where a scene has so many and it aims at up to
  /// `slots`; empty where they do as on Blender's own nodes. Measured by evidence/conditions.
  virtual std::string under_sizeless_lamps(int /*lamps*/, int /*slots*/) const { return {}; }
  /// Whether the costs that evidence/bench measures are those of the form with this setting.
  virtual bool cost_is_measured(const Setting&) const { return true; }
  /// What its closures are looked up in, made at first use; nullptr for a form without tables of its own.
  virtual const fit::Fit* fit(const Model&, const Setting&) const { return nullptr; }
  /// The number that what is fitted runs over, where one does.
  virtual std::optional<fit::FitAxis> axis(const Model&, const Setting&) const = 0;
  /// Makes or reads what it is made of, so that asking for it takes no time afterwards.
  virtual void prepare(const Model& model, const Setting& setting) const { fit(model, setting); }
};

}  // namespace brdfc::forms
