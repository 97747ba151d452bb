// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers that decide what a fit becomes. A fit that is kept is known by all of them.
#pragma once

#include <array>
#include <cstddef>

namespace brdfc::fit {

/// Angles are in radians. Errors are relative L1: the integral of |closures - model| over the model's albedo.
struct FitSettings {
  std::size_t code = 1;          ///< to be raised when the code changes so that fits become others
  std::size_t views = 33;        ///< angles of the viewer, from the normal to kLowestView, that closures are fitted at
  std::size_t trial_stride = 4;  ///< every so-many-th of them is looked at while a family and knots are chosen
  std::size_t points = 3000;     ///< directions of the light at each, about as many
  std::size_t first_steps = 4;   ///< steps between the knots that a fit along a number begins with
  std::size_t steps = 32;        ///< and the most that halving leads to
  double worse_between = 1.25;   ///< a knot is added where the error half way between two exceeds so many times
  double slightly_off = 0.005;   ///< their mean, and this
  /// Value of mixed parameters (terms.h) of the model that shows where closures are to be placed. Little, because with
  /// much of a reflectance at normal incidence they all follow the lobe that it multiplies, and what is left for it to
  /// be dark gets none.
  double some = 0.05;
  /// Pull of each colour towards that of the view above, in units of solve(). Columns have about unit integral, so it
  /// is a share of the light: what a fit may not gain by larger colours of opposite signs.
  double ridge = 1e-5;
  /// The same of facets. Their weights are not negative, so they gain nothing by size, and a strong pull would keep
  /// light from them that is theirs.
  double facet_ridge = 1e-8;
  /// Share of the albedo that facets may reflect, so that the weights of all closures can add up to it. What facets
  /// lose below the surface and behind each other is left to the ramps.
  double most_of_facets = 0.99;
  std::size_t rounds = 2;  ///< searches for the shape of facets, one from where the other ended, by view
  /// What a shape costs for its distance from that where the search began: in units of the error, by the square of its
  /// numbers. Neighbours that are alike leave little between them.
  double cost_of_distance = 0.01;
  double flatter = 1;           ///< other searches begin with stretches less by this
  double clearly_better = 0.9;  ///< and count if the error falls below this share: little better is worse between views
  /// How far lobes lean at most towards the viewer and past it: their normals by half of it. Closures whose normals lie
  /// below the surface are others in Blender 5.0 and 5.2 than in 4.5.
  double most_back = 2.8;
  double below = 0.8;            ///< how far most lobes lean towards the surface and below it, in viewer's heights
  double far_below = 1.3;        ///< and those that begin on the far side of the axis
  std::size_t fewer_points = 4;  ///< every so-many-th direction tells how facets lie
  /// How far facets lean, in units of the viewer's height times the sine of its angle: nothing where it looks along the
  /// normal. At -2 they would turn away from the viewer. Towards it they do not lean: Blender 4.5 keeps rays between
  /// the surface and a facet's horizon, though it evaluates them as 0.
  double most_lean = -1.7;
  double least_alpha = 1e-3;  ///< of facets
  /// Largest logarithm of the stretch of facets, in units of the square of the view's sine: along the normal nothing is
  /// stretched.
  double most_stretch = 3;
  /// Of roots of alpha: to that of the lobe at normal incidence, and of the second facets to those of the first.
  double least_ratio = 0.3, most_ratio = 2;
  std::size_t shape_places = 9;  ///< places of the axis at which shapes of facets are sought
  std::size_t shape_stride = 2;  ///< at every so-many-th view
  /// The shape of both facets (facet_search.h) that searches begin with.
  std::array<double, 6> first_shape = {0, 1, 0, 0, 0.85, 0};
  double lowest_view = 2e-3;  ///< kLowestView of view_axis.h
};
inline constexpr FitSettings kSettings;

/// How models are looked at from one view and closures are sought for it, by fits and twins (view.h).
struct ViewSettings {
  std::size_t error_views = 64;  ///< views at which errors are measured, at cosines evenly spaced from 1 to 0
  std::size_t points = 3000;     ///< directions, about as many, that a lobe's moments are taken from; twice for errors
  std::size_t solve_steps = 14;  ///< of solve(): least squares with new weights each time
  std::size_t search_trials = 160;  ///< the most that a search for a shape tries
  double search_tolerance = 3e-4;   ///< a search ends when the error falls by less than this share
};
inline constexpr ViewSettings kViewSettings;

/// Pairs of facet lobes of a twin.
inline constexpr std::size_t kTwinFacets = 3;

/// The same of twins (twin.h), with ViewSettings.
struct TwinSettings {
  std::size_t code = 1;     ///< as FitSettings::code
  std::size_t places = 17;  ///< of the number that a twin runs over
  std::size_t stride = 3;   ///< leaning and roughness are sought at every so-many-th view, weights at all
  std::size_t few_points = 800, points = 3000;  ///< directions, about as many, for the one and the other
  std::size_t rounds = 2;                       ///< as FitSettings::rounds
  double last_cosine = 2e-3;  ///< the view of the first knot, which is level with the surface, is this much above it
  double least_roughness = 0.03;
  double some = 0.05;  ///< as FitSettings::some
  /// How strongly a view is held to the weights of the one above it: what is as good either way would show as rings.
  double ridge = 1e-3, slight_ridge = 1e-5;
  std::size_t lead = 9;  ///< along the normal there is no view above: so many from below lead there
};
inline constexpr TwinSettings kTwinSettings;

}  // namespace brdfc::fit
