// SPDX-License-Identifier: GPL-3.0-or-later
// The search for the facets of a twin: how they lean, how rough and how far apart they are, from one view to the next.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "closures/closure.h"
#include "fit/settings.h"
#include "fit/view.h"

namespace brdfc::fit {

/// Pairs of facet lobes, and where the search begins: how far each leans towards the viewer, and all to the sides.
struct TwinDictionary {
  std::array<ClosureKind, kTwinFacets> kinds;
  std::array<double, kTwinFacets> lean;
  double spread;
};

/// Lean, roughness and spread of each pair of facet lobes, one after the other.
using TwinShape = std::vector<double>;
inline constexpr std::size_t kTwinShape = 3;

/// One of a pair, on the side of the plane of incidence that the sign of `spread` says.
Closure<double> twin_facet(ClosureKind, double lean, double roughness, double spread, const Vec3<double>& wo);

/// What each closure gives at the view's points, the matte one last; facets of which nothing is above the surface
/// give 0.
Eigen::MatrixXd twin_columns(const TwinDictionary&, const TwinShape&, const View&);

/// Weights of these columns for a column of the view's f, drawn to those of `near` by `ridge`, as solve() does.
Eigen::VectorXd twin_weights(const Eigen::MatrixXd& columns, const View&, Eigen::Index column,
                             const Eigen::VectorXd& near, double ridge);

/// Shapes of all views, which begin at the normal and go down.
struct TwinShapes {
  const TwinDictionary* dictionary = nullptr;
  std::vector<std::vector<TwinShape>> shapes;  ///< by place and view
};
/// Those of the dictionary that comes closest at a few places, from the best of these on, by place and view: `views`
/// have the columns of one term after those of the other; `mixtures` is mixtures_of() of the terms (solution.h).
TwinShapes find_twin_shapes(const std::vector<std::vector<View>>& views, const Eigen::MatrixXd& mixtures);

}  // namespace brdfc::fit
