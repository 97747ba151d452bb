// SPDX-License-Identifier: GPL-3.0-or-later
// The parameter that the tables of a fit run over.
#pragma once

#include <string>

#include "core/axis_scale.h"
#include "model/model.h"

namespace brdfc::fit {

/// A Number parameter, from one end of its slider to the other.
struct FitAxis {
  std::string parameter;  ///< its name
  double low, high;       ///< ends of the slider, in units of the parameter
  AxisScale scale;        ///< the scale on which places are even

  /// The parameter's value at `place`, from 0 at the low end to 1 at the high end. A place outside that interval gives
  /// the value of the nearest end.
  double at(double place) const;
  /// The place of a value, in [0, 1]. Values beyond the ends of the slider have the place of the nearest end. T is
  /// double or Expr.
  template <class T> T place(const T& value) const;
};

/// The whole axis as one line of text, for store keys.
std::string text_of(const FitAxis&);

/// The axis for a Number parameter: the range of its slider, on the scale that the schema declares.
FitAxis fit_axis(const ParamInfo&);

}  // namespace brdfc::fit
