// SPDX-License-Identifier: GPL-3.0-or-later
// Fits of curves to a measured BRDF, for a model whose highlight is a product of powers of its parameters, such as the
// heights of its curves: a nonlinear least-squares problem in their logarithms.
#pragma once

#include <optional>

#include "measured/fit_models.h"
#include "measured/pairs.h"

namespace brdfc::measured {

/// How parameters of a model make its f: matte light + strength * (a product of powers of the curves' heights). The
/// powers depend on the directions; those of the first curve and the rest also on the roughnesses and the shape.
struct CurveRoles {
  const ParamInfo* matte = nullptr;               ///< a colour; the matte light is in proportion to it
  const ParamInfo* rim = nullptr;                 ///< a number: the matte light is a square function of it
  const ParamInfo* strength = nullptr;            ///< a number
  std::vector<const ParamInfo*> shape;            ///< numbers: what the lobe is about
  std::vector<const ParamInfo*> roughness;        ///< numbers, along the tangent first
  std::vector<const ParamInfo*> colors, numbers;  ///< heights: of each channel, and of all three
};
/// The roles of a model's parameters; nullopt for a model that is not made of curves.
std::optional<CurveRoles> curve_roles(const Model&);

/// The curves that come closest to the data, with the error for `last`. Roughnesses are equal for isotropic data.
ModelFit fit_factors(const Model&, const CurveRoles&, bool isotropic, const Pairs& coarse, const Pairs& fine,
                     const Pairs& last);

}  // namespace brdfc::measured
