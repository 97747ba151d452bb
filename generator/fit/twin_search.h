// SPDX-License-Identifier: GPL-3.0-or-later
// The search for the facets of a twin: lean, roughness and spread, from one view to the next.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "closures/closure.h"
#include "fit/settings.h"
#include "fit/view.h"

namespace brdfc::fit {

/// The kinds of the pairs of facet lobes, and the start of the search: the lean of each towards the viewer, and the
/// spread of all to the sides.
struct TwinDictionary {
  std::array<ClosureKind, kTwinFacets> kinds;
  std::array<double, kTwinFacets> lean;
  double spread;
};

/// Lean, roughness and spread of each pair of facet lobes, one after the other.
using TwinShape = std::vector<double>;
inline constexpr std::size_t kTwinShape = 3;

/// One facet of a pair; the sign of `spread` selects the side of the plane of incidence.
Closure<double> twin_facet(ClosureKind, double lean, double roughness, double spread, const Vec3<double>& wo);

/// The values of each closure at the view's points; the last column is the matte one. Facets that are entirely below
/// the surface give 0.
Eigen::MatrixXd twin_columns(const TwinDictionary&, const TwinShape&, const View&);

/// The weights of these columns that fit a column of the view's f. `ridge` pulls them towards those of `near`, as in
/// solve().
Eigen::VectorXd twin_weights(const Eigen::MatrixXd& columns, const View&, Eigen::Index column,
                             const Eigen::VectorXd& near, double ridge);

/// The shapes at all views, from the normal downwards.
struct TwinShapes {
  const TwinDictionary* dictionary = nullptr;
  std::vector<std::vector<TwinShape>> shapes;  ///< by place and view
};
/// The shapes for the dictionary that fits best at a few places; the search starts from the best of these places.
/// `views` are by place and view, and their f has the columns of the first term, then those of the second, and so on.
/// `mixtures` is mixtures_of() of the terms (solution.h).
TwinShapes find_twin_shapes(const std::vector<std::vector<View>>& views, const Eigen::MatrixXd& mixtures);

}  // namespace brdfc::fit
