// SPDX-License-Identifier: GPL-3.0-or-later
// What measured data lack or break, measured.
#pragma once

#include <string>
#include <vector>

#include "measured/measured_model.h"

namespace brdfc::measured {

struct Findings {
  struct View {
    double degrees;      ///< to the normal
    Rgb<double> albedo;  ///< over all azimuths of the view
  };
  std::vector<View> views;
  /// |f(wi, wo) - f(wo, wi)| cos cos over f cos cos, integrated over both hemispheres.
  double non_reciprocal = 0;
  /// A sentence each for what a user should know.
  std::vector<std::string> sentences;
};
/// `degrees` are the views' angles to the normal, below 90.
Findings findings(const Measurement&, const MeasuredModel&, const std::vector<double>& degrees);

}  // namespace brdfc::measured
