// SPDX-License-Identifier: GPL-3.0-or-later
// The linear part of a fit: the colours of ramps and the weights of facets, when the closures are known.
//
// A ramp has eight colours, which may be negative, so it is linear in eight numbers, and fitting a view is a linear
// problem: see solve() in view.h.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "fit/facet_search.h"
#include "fit/parts.h"
#include "fit/terms.h"
#include "fit/view.h"

namespace brdfc::fit {

/// The solution for a view.
struct ViewSolution {
  const View* view;
  std::vector<RampLobe> lobes;
  std::vector<Facet> facets;
  Eigen::MatrixXd a;      ///< dictionary() of lobes and facets, each column divided by its scale; cleared after solving
  Eigen::VectorXd scale;  ///< scale of each column
  Eigen::MatrixXd x;      ///< coefficients of the columns of a, one column for each column of the view's f
};

/// The solution for some parameters of the model.
struct Solution {
  std::vector<ViewSolution> views;
  double error = 0;  ///< relative L1, mean over the views, for the worst mixture and channel
};

/// Values of mixed parameters as arguments of Terms::weights().
std::map<std::string, Rgb<double>> colours_of(const ParamValues&);

/// The mixtures of terms at which a fit's error is measured: one row per mixture, one column per term with its weight.
/// No mixture between them has a larger error than the worst of these. Without mixed parameters it is one row with the
/// number 1.
Eigen::MatrixXd mixtures_of(const Terms&);

/// Fits every `stride`-th view, starting with the view along the normal; each is pulled slightly towards the view
/// above. Their f has the columns of the first term, then those of the second, and so on. `shape` returns the shape of
/// facets for the index of a view; an empty function selects a family without facets.
Solution solve_views(const std::vector<View>&, std::size_t stride, Family, const Terms&,
                     const std::function<FacetShape(std::size_t view)>& shape);

}  // namespace brdfc::fit
