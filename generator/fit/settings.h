// SPDX-License-Identifier: GPL-3.0-or-later
// The constants that determine a fit. All of them are part of the key of a stored fit.
#pragma once

#include <array>
#include <cstddef>

namespace brdfc::fit {

/// Angles are in radians. Errors are relative L1: the integral of |closures - model| divided by the model's albedo.
struct FitSettings {
  std::size_t code = 1;          ///< to be raised when a change of the code changes fits
  std::size_t views = 33;        ///< views that closures are fitted at; their angles go from the normal to kLowestView
  std::size_t trial_stride = 4;  ///< every n-th of them is used while a family and knots are chosen
  std::size_t points = 3000;     ///< approximate number of light directions per view
  std::size_t first_steps = 4;   ///< initial number of steps between knots of a fit along a number
  std::size_t steps = 32;        ///< largest number of steps, after halving
  double worse_between = 1.25;   ///< a knot is added between two where the error exceeds their mean times this
  double slightly_off = 0.005;   ///< plus this
  /// Value of the mixed parameters (terms.h) of the model that determines where closures are placed. It is small: with
  /// a high reflectance at normal incidence all closures would follow the lobe that is multiplied by it, and none would
  /// be left for the lobe that remains when it is dark.
  double some = 0.05;
  /// Regularisation of each colour towards that of the view above, in units of solve(). Columns have integrals of about
  /// 1, so this is a share of the light. It prevents large colours of opposite signs.
  double ridge = 1e-5;
  /// The same for facets. Their weights are not negative, so they can't grow with opposite signs, and a strong pull
  /// would keep facets from light that they should reflect.
  double facet_ridge = 1e-8;
  /// Largest share of the albedo that facets may reflect, so that the weights of all closures can add up to it. The
  /// light that facets lose below the surface and behind each other is left to the ramps.
  double most_of_facets = 0.99;
  std::size_t rounds = 2;  ///< searches for the shape of facets per view, each starting where the last one ended
  /// Penalty for the distance of a shape from the start of its search: in units of the error, times the squared change
  /// of its numbers. Similar shapes at neighbouring views keep the interpolation error small.
  double cost_of_distance = 0.01;
  double flatter = 1;           ///< further searches start with a stretch smaller by this
  double clearly_better = 0.9;  ///< and count if the error falls below this share; slight gains harm interpolation
  /// Largest lean of lobes towards the viewer and past it; the normal leans by half of it. Closures whose normals are
  /// below the surface look different in Blender 5.0 and 5.2 than in 4.5.
  double most_back = 2.8;
  double below = 0.8;            ///< largest lean of most lobes towards the surface and below it, in viewer's heights
  double far_below = 1.3;        ///< and of lobes that start on the far side of the axis
  std::size_t fewer_points = 4;  ///< every n-th direction is used for the shape of facets
  /// Largest lean of facets, in units of the viewer's height times the sine of the view angle; so it is 0 for a view
  /// along the normal. At -2 they would turn away from the viewer. They don't lean towards the viewer: Blender 4.5 does
  /// not discard samples between the surface and a facet's horizon, although it evaluates them as 0.
  double most_lean = -1.7;
  double least_alpha = 1e-3;  ///< smallest alpha of facets
  /// Largest logarithm of the stretch of facets, in units of the squared sine of the view angle; so there is no stretch
  /// for a view along the normal.
  double most_stretch = 3;
  /// Range of ratios of the square roots of alpha: of the first facet to the lobe at normal incidence, and of the
  /// second facet to the first.
  double least_ratio = 0.3, most_ratio = 2;
  std::size_t shape_places = 9;  ///< places on the axis at which shapes of facets are searched
  std::size_t shape_stride = 2;  ///< at every n-th view
  /// The shape of both facets (facet_search.h) at which searches start.
  std::array<double, 6> first_shape = {0, 1, 0, 0, 0.85, 0};
  double lowest_view = 2e-3;  ///< kLowestView of view_axis.h
};
inline constexpr FitSettings kSettings;

/// Settings of views, and of the search for closures at one view, for fits and twins (view.h).
struct ViewSettings {
  std::size_t error_views = 64;     ///< views at which errors are measured, at cosines evenly spaced from 1 to 0
  std::size_t points = 3000;        ///< approximate number of directions for a lobe's moments; twice for errors
  std::size_t solve_steps = 14;     ///< iterations of solve(): least squares with new weights each time
  std::size_t search_trials = 160;  ///< largest number of trials in a search for a shape
  double search_tolerance = 3e-4;   ///< a search ends when the error falls by less than this share
};
inline constexpr ViewSettings kViewSettings;

/// Number of pairs of facet lobes in a twin.
inline constexpr std::size_t kTwinFacets = 3;

/// The same for twins (twin.h), beside ViewSettings.
struct TwinSettings {
  std::size_t code = 1;                         ///< as FitSettings::code
  std::size_t places = 17;                      ///< of the number that a twin runs over
  std::size_t stride = 3;                       ///< lean and roughness are searched at every n-th view, weights at all
  std::size_t few_points = 800, points = 3000;  ///< approximate number of directions for these two steps
  std::size_t rounds = 2;                       ///< as FitSettings::rounds
  double last_cosine = 2e-3;  ///< cosine used for the view of the first knot, which itself is along the surface
  double least_roughness = 0.03;
  double some = 0.05;  ///< as FitSettings::some
  /// Regularisation of the weights towards those of the view above. Without it, equally good solutions that differ
  /// between views would be visible as rings.
  double ridge = 1e-3, slight_ridge = 1e-5;
  std::size_t lead = 9;  ///< there is no view above the normal: solving starts this many views below and goes up
};
inline constexpr TwinSettings kTwinSettings;

}  // namespace brdfc::fit
