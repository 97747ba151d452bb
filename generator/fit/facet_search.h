// SPDX-License-Identifier: GPL-3.0-or-later
// The search for the shape of a fit's facets: how far they lean, how rough they are and how far they are stretched.
#pragma once

#include <vector>

#include "fit/parts.h"
#include "fit/settings.h"
#include "fit/view.h"

namespace brdfc::fit {

/// The variables of the search: kNumbersOfFacet numbers for each of two facets. First, how far it leans, in units of
/// the viewer's height (radians) times the sine of the view angle. Second, the square root of its alpha, relative to
/// that of the previous facet, and for the first facet relative to the alpha that gives the width of the lobe at normal
/// incidence. Third, the logarithm of its stretch, divided by the square of that sine.
using FacetShape = std::vector<double>;
inline constexpr std::size_t kNumbersOfFacet = 3;
/// The starting point of the first search.
inline const FacetShape kFirstShape{kSettings.first_shape.begin(), kSettings.first_shape.end()};

/// The facets with this shape at a view. `at_normal` is the model's lobe at normal incidence.
std::vector<Facet> facets_of(const FacetShape&, const Moments& at_normal, const Vec3<double>& wo);

/// Relative L1 error of the best sum of these facets and a matte closure; the mean over the columns of the view's f.
double facet_error(const std::vector<Facet>&, const View&);

/// The best shape that a search starting at `shape` finds for a view, using a subset of its points.
FacetShape improved(const FacetShape& shape, const Moments& at_normal, const View&);

}  // namespace brdfc::fit
