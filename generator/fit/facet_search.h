// SPDX-License-Identifier: GPL-3.0-or-later
// The search for how a fit's facets lean, how rough they are and how they are stretched.
#pragma once

#include <vector>

#include "fit/parts.h"
#include "fit/settings.h"
#include "fit/view.h"

namespace brdfc::fit {

/// What facets are sought by, kNumbersOfFacet numbers for each of two: how far it leans, in units of the viewer's
/// height (radians) times the sine of its angle; the root of its alpha in units of that of the one before, the first
/// one's of that which gives the lobe at normal incidence its width; the logarithm of its stretch, by the square of
/// that sine.
using FacetShape = std::vector<double>;
inline constexpr std::size_t kNumbersOfFacet = 3;
/// Where the first search begins.
inline const FacetShape kFirstShape{kSettings.first_shape.begin(), kSettings.first_shape.end()};

/// The facets of a shape at a view; `at_normal` is the model's lobe at normal incidence.
std::vector<Facet> facets_of(const FacetShape&, const Moments& at_normal, const Vec3<double>& wo);

/// Relative L1 of the best sum of these facets and a matte closure, mean over the columns of the view's f.
double facet_error(const std::vector<Facet>&, const View&);

/// The shape that a search from `shape` on finds best for a view, by few of its points.
FacetShape improved(const FacetShape& shape, const Moments& at_normal, const View&);

}  // namespace brdfc::fit
