// SPDX-License-Identifier: GPL-3.0-or-later
// A model bound to parameters, and checks of the values that it returns.
#pragma once

#include <memory>
#include <string>

#include "model/model.h"

namespace brdfc::measure {

/// A model, its parameters in double precision, and a label for messages.
struct BoundModel {
  const Model* model = nullptr;        ///< registered, so it outlives this object
  ParamValues values;                  ///< a value for every parameter
  std::unique_ptr<Brdf<double>> brdf;  ///< the model at these values
  std::string label;                   ///< name and values, "coupled r0=0.05 ...", for messages
};
/// Binds a model to `values`. Missing values take their defaults. Throws InputError for inadmissible values.
BoundModel bind_model(const Model&, const ParamValues&);

/// "(x, y, z)" with this number of digits, for messages.
std::string text(const Vec3<double>&, int digits = 9);

/// Throws ValueError unless every component is finite and >= 0. `what` is "f", "pdf", ...
void require_value(const Rgb<double>& value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo);
void require_value(double value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo);

}  // namespace brdfc::measure
