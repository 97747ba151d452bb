// SPDX-License-Identifier: GPL-3.0-or-later
// The axis of a fit's tables that runs over the view: 0 along the normal, 1 at the lowest view that closures are fitted
// to. Knots are even on it and crowd towards the horizon, where lobes change most.
#pragma once

#include <cmath>

#include "core/scalar.h"
#include "core/vec.h"
#include "fit/settings.h"

namespace brdfc::fit {

/// The height, as a cosine, of the lowest view that closures are fitted to. Of a lower one, as bent and interpolated
/// normals have it too, the normal is turned towards the viewer until the view is as high: about the normal itself
/// closures would turn black one after the other, and what is left of the sum no longer cancels.
inline constexpr double kLowestView = kSettings.lowest_view;

/// How much of the way from the normal to the horizon the axis leaves out, on the scale of its places.
inline double beyond_lowest_view() { return std::sqrt(2 * kInvPi * std::asin(kLowestView)); }

/// The place of a view on the axis, or on a piece of it that begins at place `first` and is `length` long. Views along
/// the surface and below it have the place of the horizon, a little beyond 1.
template <class T> T view_place(const Vec3<T>& wo, double first = 0, double length = 1) {
  // The angle above the surface, from its half, keeps its digits at the horizon.
  const T height = named("height_o", T(2) * atan(wo.z / (T(1) + sqrt(sin2_theta(wo)))));
  const double whole = 1 - beyond_lowest_view();
  return (T(1 - whole * first) - sqrt(maximum(height, T(0)) * T(2 * kInvPi))) / T(whole * length);
}

/// The view at a place from 0 to 1, with a y of 0.
inline Vec3<double> view_at(double place) {
  const double height = kPi / 2 * sqr(1 - place * (1 - beyond_lowest_view()));
  return {std::cos(height), 0, std::sin(height)};
}

}  // namespace brdfc::fit
