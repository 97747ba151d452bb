// SPDX-License-Identifier: GPL-3.0-or-later
// Closures that stand in for a model in EEVEE and wherever else its shader does not run, in place of a fitted twin.
// They follow every parameter, while a fitted twin follows one number and some colours: for models whose parameters
// are usually far from the defaults.
//
// A model declares them as stand_in(wo), and registers that with BRDFC_STAND_IN after BRDFC_MODEL. They are of kinds
// that EEVEE has: Diffuse, and Ggx and Beckmann with one roughness, about the surface's normal. Weights are not
// negative. They depend on wo.z alone.
#pragma once

#include "closures/closure.h"
#include "model/bound_as.h"

namespace brdfc::inline model {

struct StandIn {
  /// A Recorder must be active.
  ClosureSum<Expr> (*record)(const ModelInfo&, const ParamValues& fixed, const Vec3<Expr>& wo);
  ClosureSum<double> (*bound)(const ModelInfo&, const ParamValues&, const Vec3<double>& wo);
};
/// That of the model, or a null pointer.
inline const StandIn* stand_in(const Model& model) { return beside<StandIn>(model); }
/// Called by BRDFC_STAND_IN before main().
inline bool register_stand_in(const std::string& name, const StandIn& closures) {
  return registered_beside<StandIn>().emplace(name, closures).second;
}

namespace detail {

template <template <class> class M> StandIn stand_in_of() {
  return {[](const ModelInfo& info, const ParamValues& fixed, const Vec3<Expr>& wo) {
            return recorded_as<M>(info, fixed).stand_in(wo);
          },
          [](const ModelInfo& info, const ParamValues& given, const Vec3<double>& wo) {
            return bound_as<M>(info, given).stand_in(wo);
          }};
}

}  // namespace detail

#if BRDFC_BASELINE
#define BRDFC_STAND_IN(M)             \
  bool the_class_##M##_has_stand_in = \
      ::brdfc::register_stand_in(M<double>::info().name, ::brdfc::model::detail::stand_in_of<M>());
#else
#define BRDFC_STAND_IN(M)
#endif

}  // namespace brdfc::inline model
