// SPDX-License-Identifier: GPL-3.0-or-later
// The number that a fit runs over.
#pragma once

#include <string>

#include "core/axis_scale.h"
#include "model/model.h"

namespace brdfc::fit {

/// A Number parameter from one end of its slider to the other.
struct FitAxis {
  std::string parameter;  ///< its name
  double low, high;       ///< ends of the slider, in units of the parameter
  AxisScale scale;        ///< on which places are even

  /// The parameter's value at `place`, from 0 at the low end to 1 at the high one; beyond them that of the end.
  double at(double place) const;
  /// The place of a value, in [0, 1]; values beyond the ends have the place of the end. Over double and Expr.
  template <class T> T place(const T& value) const;
};

/// All of it in a line, for the key of what is kept.
std::string text_of(const FitAxis&);

/// The axis that a Number parameter gives: its slider, on the scale that the schema declares.
FitAxis fit_axis(const ParamInfo&);

}  // namespace brdfc::fit
