// SPDX-License-Identifier: GPL-3.0-or-later
// The view axis of a fit's tables: 0 along the normal, 1 at the lowest view that closures are fitted to. Knots are
// evenly spaced on it, and so dense near the horizon, where lobes change most.
#pragma once

#include <cmath>

#include "core/scalar.h"
#include "core/vec.h"
#include "fit/settings.h"

namespace brdfc::fit {

/// The cosine of the lowest view that closures are fitted to. Lower views occur, also with bump maps and interpolated
/// normals; for them the normal is turned towards the viewer until the view has this height. Otherwise the closures
/// would become black one after the other, and the rest of the sum would no longer cancel.
inline constexpr double kLowestView = kSettings.lowest_view;

/// The part of the way from the normal to the horizon that the axis leaves out, on the scale of its places.
inline double beyond_lowest_view() { return std::sqrt(2 * kInvPi * std::asin(kLowestView)); }

/// The place of a view on the axis, or on a part of the axis that begins at place `first` and has length `length`.
/// Views along the surface and below it have the place of the horizon, slightly above 1.
template <class T> T view_place(const Vec3<T>& wo, double first = 0, double length = 1) {
  // Computing the angle above the surface from half of it preserves precision at the horizon.
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
