// SPDX-License-Identifier: GPL-3.0-or-later
// Sets the inputs of a recorded model from parameter values.
#pragma once

#include "model/model.h"
#include "trace/program.h"

namespace brdfc::inline model {

/// Sets the inputs of a recorded model to the numbers and colours in `values`, by name. Choices are not recorded, so
/// they are ignored.
template <class T> void set_inputs(Inputs<T>& inputs, const ParamValues& values) {
  for (const auto& [name, value] : values) {
    if (const double* v = std::get_if<double>(&value)) set_input(inputs, name, *v);
    if (const auto* c = std::get_if<std::array<double, 3>>(&value)) inputs[name] = {T((*c)[0]), T((*c)[1]), T((*c)[2])};
  }
}

}  // namespace brdfc::inline model
