// SPDX-License-Identifier: GPL-3.0-or-later
// A model with its parameters, and what is asked of the values that it gives.
#pragma once

#include <memory>
#include <string>

#include "model/model.h"

namespace brdfc::measure {

/// A model bound to parameters in double precision, with the text that names both in messages.
struct BoundModel {
  const Model* model = nullptr;        ///< registered, so that it outlives this
  ParamValues values;                  ///< a value for every parameter
  std::unique_ptr<Brdf<double>> brdf;  ///< the model at these values
  std::string label;                   ///< name and values, "coupled r0=0.05 ...", for messages
};
/// The model at `values`, defaults in the place of those that are missing. Throws InputError for inadmissible ones.
BoundModel bind_model(const Model&, const ParamValues&);

/// "(x, y, z)" with so many digits, for messages.
std::string text(const Vec3<double>&, int digits = 9);

/// Throws ValueError unless every component is finite and >= 0. `what` is "f", "pdf", ...
void require_value(const Rgb<double>& value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo);
void require_value(double value, const char* what, const std::string& label, const Vec3<double>& wi,
                   const Vec3<double>& wo);

}  // namespace brdfc::measure
