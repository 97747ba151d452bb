// SPDX-License-Identifier: GPL-3.0-or-later
// A model with its parameters, and what is asked of the values that it gives.
#pragma once

#include <memory>
#include <string>

#include "model/model.h"

namespace brdfc::measure {

/// A model bound to parameters in double precision, with the text that names both in messages.
struct BoundModel {
  const Model* model = nullptr;
  ParamValues values;  ///< complete
  std::unique_ptr<Brdf<double>> brdf;
  std::string label;  ///< "coupled r0=0.05 ..."
};
/// Throws InputError for inadmissible values.
BoundModel bind_model(const Model&, const ParamValues&);

/// "(x, y, z)" for messages.
std::string text(const Vec3<double>&, int digits = 9);

/// Throws ValueError unless every component is finite and >= 0. `what` is "f", "pdf", ...
void require_value(const Rgb<double>& value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo);
void require_value(double value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo);

}  // namespace brdfc::measure
