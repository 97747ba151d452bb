// SPDX-License-Identifier: GPL-3.0-or-later
// Functions that are registered beside a model because the class Model lacks them, and models with their own type,
// which such functions need.
#pragma once

#include <map>

#include "model/model.h"

namespace brdfc::inline model {

/// What is registered beside models, by their names.
template <class Beside> std::map<std::string, Beside>& registered_beside() {
  static std::map<std::string, Beside> known;
  return known;
}
/// That of the model, or a null pointer.
template <class Beside> const Beside* beside(const Model& model) {
  const auto it = registered_beside<Beside>().find(model.info().name);
  return it == registered_beside<Beside>().end() ? nullptr : &it->second;
}

/// With inputs for all parameters but the fixed ones, as Model::record() has them.
template <template <class> class M> M<Expr> recorded_as(const ModelInfo& info, const ParamValues& fixed) {
  const ParamValues values = complete(info, fixed);
  M<Expr> m;
  m.parameters(detail::RecordVisitor{values, fixed});
  return m;
}

/// With values for all parameters; those that `given` lacks have their defaults.
template <template <class> class M> M<double> bound_as(const ModelInfo& info, const ParamValues& given) {
  const ParamValues values = complete(info, given);
  M<double> m;
  m.parameters(detail::BindVisitor<double>{values});
  return m;
}

}  // namespace brdfc::inline model
