// SPDX-License-Identifier: GPL-3.0-or-later
// The linear part of a fit: colours of ramps and weights of facets, once it is settled which closures there are.
//
// Ramps take eight colours that may be negative, so each is a family that is linear in eight numbers, and a view is a
// linear problem: see solve() in view.h.
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

/// What was found for a view.
struct ViewSolution {
  const View* view;
  std::vector<RampLobe> lobes;
  std::vector<Facet> facets;
  Eigen::MatrixXd a;      ///< dictionary() of both, each column divided by its scale; empty once it is solved
  Eigen::VectorXd scale;  ///< of the columns
  Eigen::MatrixXd x;      ///< coefficients of the columns, a column for each of the view's f
};

/// What was found for some parameters of the model.
struct Solution {
  std::vector<ViewSolution> views;
  double error = 0;  ///< relative L1, mean over the views, of the worst mixture and channel
};

/// Values of mixed parameters as the arguments of Terms::weights().
std::map<std::string, Rgb<double>> colours_of(const ParamValues&);

/// The mixtures of terms that tell a fit's error: a row a mixture, a column the weight of a term. The error between
/// them is nowhere larger than the largest of theirs. Without mixed parameters one row, of the number 1.
Eigen::MatrixXd mixtures_of(const Terms&);

/// Fits every `stride`-th of the views, from that along the normal on, each drawn a little towards the one above. Their
/// f has the columns of one term after those of the other. `shape` gives the shape of facets for a view's index; an
/// empty one means a family without them.
Solution solve_views(const std::vector<View>&, std::size_t stride, Family, const Terms&,
                     const std::function<FacetShape(std::size_t view)>& shape);

}  // namespace brdfc::fit
