// SPDX-License-Identifier: GPL-3.0-or-later
// Models with their own type, for functions that are registered beside a model because the class Model lacks them.
#pragma once

#include "model/model.h"

namespace brdfc::inline model {

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
