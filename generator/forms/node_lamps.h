// SPDX-License-Identifier: GPL-3.0-or-later
// How the form made of nodes (nodes.cpp) handles lamps: as cones of directions. Without Open Shading Language, Cycles
// drops closures that subtract light. So the light that a closure carries for a lamp can't be subtracted elsewhere and
// has to be left out there.
//
// Lamps: Toon closures, constant over the lamp's cone or cones, with a part of the model's f cos at a random point of
// the lamp. Rest: a direction drawn from the model. If it hits one of these lamps, it carries the other part of f cos.
//
// The two parts are those of multiple importance sampling (Veach and Guibas 1995, power heuristic, exponent 4). So
// drawn directions find the highlight of a lobe that is narrow for its lamp, and the closure has the light of a lamp
// that is small for the lobe. The two parts add up to f cos in every direction.
//
// A ball or a sun fills its cone. A rectangle or an ellipse does not, so its closures carry the light of the whole
// lamp. A wide one that looks about square or round from the shading point has four cones, two by two; otherwise a
// rectangle has up to four in a row along the axis that looks longer, and an ellipse the largest that fits into it.
// Each carries the light of its part of the lamp, with the model's value at a point of that part. So if an object hides
// a part of the lamp, its light is missing, and not that of the average over the lamp. Cones may overlap, since only
// their sum counts. Cycles drops closures with a small weight, so the cone of a small lamp is widened until it carries
// kWidened of the light; that share of the light beside the lamp then counts twice. If the cones of two lamps overlap,
// light in the overlap would count twice. If one of them is a rectangle or an ellipse and the other is a much smaller
// ball or sun, as behind a window, the wide one has a cone beside the small one (cone_aside). Otherwise the earlier
// lamp in the list, which is sorted by size with the widest first, is left to drawn directions.
//
// The formulas run only as nodes (print/node_program.h), for which a division by 0 and the root of a negative number
// give 0.
#pragma once

#include "core/vec.h"
#include "forms/node_cones.h"
#include "model/model.h"

namespace brdfc::forms {

/// A point of a rectangle or an ellipse, chosen by two numbers in [0, 1).
template <class T> struct FlatPoint {
  Vec3<T> wi;  ///< unit vector to the point
  T emphasis;  ///< emphasis_at() the point
  T bounds;    ///< if the lamp is small, the radius of a cone around all of it, with a seam; 4 if the horizon cuts it
};
/// The point lies in the given part. Points of neighbouring parts are mirrored, so that they are on the
/// whole less noisy.
template <class T> FlatPoint<T> flat_point(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                                           const LampCone<T>& cone, const LampPart<T>& part, const T& u, const T& v) {
  const auto round = slot.kind > T(3.5);
  const T layout = cone.cones.layout;
  const auto grid = in_grid(layout), along = layout < T(0);
  const T radius = sqrt(u), turn = pi<T>() * v * select(grid, T(0.5), T(2));
  // From -1 to 1 in the part, then in the part of the lamp above the horizon, then in the whole lamp.
  const T p = (T(1) - T(2) * u) * part.across, q = (T(2) * v - T(1)) * (part.across * part.along);
  const auto in_row = [&](const T& p) { return (p + T(2) * part.index + T(1)) / abs(layout) - T(1); };
  const T x_above = select(grid, (p + part.across) / T(2), select(along, p, in_row(p)));
  const T y_above = select(grid, (q + part.along) / T(2), select(along, in_row(q), q));
  const auto within = [](const T& part, const T& x) { return select(part < T(0), T(-1), T(1)) - part + part * x; };
  const T x = select(round, radius * cos(turn) * part.across, within(cone.part_across, x_above));
  const T y = select(round, radius * sin(turn) * part.along, within(cone.part_along, y_above));
  const Vec3<T> point = lamp.across * (lamp.half_across * x) + lamp.along * (lamp.half_along * y) + (slot.place - at);
  const T distance2 = dot(point, point);
  FlatPoint<T> out;
  out.wi = point * (T(1) / sqrt(distance2));
  const T cosine = maximum(dot(lamp.away, out.wi), T(0));
  out.emphasis = emphasis_at(slot, lamp, cosine, distance2, cone.of_cones) * part_of_area(cone);
  constexpr double kCut = 4;
  out.bounds =
      select(T(0.999) < part_of_area(cone), farthest_of(slot, lamp) / sqrt(distance2) + T(2 * kNarrow), T(kCut));
  return out;
}

/// The solid angle of a lamp's cones, or 0 for one that drawn directions can't hit: its first size is negative
/// (blender_addon/lamps/slots.py).
template <class T> T met_angle(const Vec3<T>& shape, const LampCone<T>& cone) {
  return select(T(0) < shape.y, cone.of_cones, T(0));
}

/// The part of f cos in one direction that the lamp's closure carries; the drawn direction carries the rest of it.
/// `solid_angle`: met_angle(). `density`: pdf of drawn directions there. `emphasis`: 1 for a ball or a sun.
///
/// Cycles follows one closure at a time, so the part of a drawn direction is noisy unless it is small or nearly
/// everything. The closure is only as noisy as f is uneven over the lamp. So it keeps its light until drawn directions
/// hit the lamp so often that the lobe must be narrower than the lamp, and then gives it up quickly.
template <class T> T part_of_lamp(const T& solid_angle, const T& emphasis, const T& density) {
  /// Where both carry one half: the density, in units of that of a uniform point of the lamp.
  constexpr double kEqual = 2;
  // The point of a rectangle has the pdf 1 / (solid_angle emphasis), and since Cycles samples all of the rectangle,
  // only one sample in `emphasis` meets its cone.
  const T ratio = density * (solid_angle * sqr(emphasis)) * T(1 / kEqual);
  return T(1) / (T(1) + sqr(sqr(ratio)));
}

/// What the closure of a lamp carries of f cos in a drawn direction: part_of_lamp() if the direction hits the lamp or
/// passes so close that its lobe would, otherwise 0.
template <class T> T met_part(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                              const LampCone<T>& cone, const Vec3<T>& ray, const T& density) {
  const auto flat = slot.kind > T(2.5) && slot.kind<T(4.5), round = slot.kind> T(3.5);
  const PlanePoint<T> p = plane_point(slot, lamp, at, ray);
  const T seam = T(kNarrow) * p.distance;
  const T x = (abs(dot(p.off, lamp.across)) - seam) / lamp.half_across;
  const T y = (abs(dot(p.off, lamp.along)) - seam) / lamp.half_along;
  const T farthest = select(round, maximum(x, T(0)) * x + maximum(y, T(0)) * y, maximum(x, y));
  const auto on_flat = farthest < T(1) && T(0) < p.slope;
  const T met = select(flat, select(on_flat, T(1), T(0)), select(length(ray - cone.towards) < cone.chord, T(1), T(0)));
  const T solid_angle = met_angle(slot.shape, cone);
  const T emphasis = emphasis_at(slot, lamp, p.slope, sqr(p.distance), solid_angle) * part_of_area(cone);
  return met * part_of_lamp(solid_angle, select(flat, emphasis, times_cone(cone, solid_angle)), density);
}

/// Closures with smaller weights are kept at random. Cycles drops those whose channels are below 1e-5 on average.
inline constexpr double kLeastKept = 4e-5;
/// Russian roulette for a closure with a small weight, which Cycles would drop: it is kept at random, with a weight
/// increased accordingly. `u` is from 0 to 1.
template <class T> T kept(const T& weight, const T& u) {
  const T chance = weight * T(1 / kLeastKept);
  return select(u < chance, T(1), T(0)) / minimum(chance, T(1));
}

/// The inputs of the Toon closures, one for each cone, that carry `value`, as f cos, over it: as much of it as
/// part_of_lamp() says. For a small lamp the closure may be wider than the cone.
template <class T> struct ToonLobe {
  Rgb<T> color;
  T size;   ///< in units of 90 degrees, as in the node
  T whole;  ///< 1 if it is the single cone around all of a small flat lamp, otherwise 0
};
/// `of_part`: the radius of a cone within a flat lamp. `bounds`: FlatPoint::bounds. `index`: of the cone. `pick`: a
/// random number in [0, 1), which picks the part whose value a small lamp has. `room`: the radius that a cone may have
/// without covering another lamp. `emphasis`, `density`: at the point where the value is taken. `share`: the light of
/// that point divided by the mean over the cone.
template <class T> ToonLobe<T> toon_lobe(const Vec3<T>& shape, const LampCone<T>& cone, const T& of_part,
                                         const T& bounds, const T& index, const T& pick, const T& emphasis,
                                         const T& share, const T& density, const T& room, const Rgb<T>& value,
                                         const T& u) {
  constexpr double kWidened = 2e-4;
  const T part = part_of_lamp(met_angle(shape, cone), emphasis, density) / cone.clear;
  const T brightest = max_component(value) * part;
  const T within2 = cone.of_cones / (count_of(cone.cones.layout) * T(kPi));
  // A flat lamp whose closures would be kept at random has a single cone around all of it, if that is faint, too.
  const auto flat = cone.flat > T(0.5);
  const auto is_whole =
      flat && brightest * emphasis * within2 * T(kPi) < T(kLeastKept) && brightest * sqr(bounds) * T(kPi) < T(kWidened);
  const T picked = pick * count_of(cone.cones.layout) - index;
  const auto is_picked = T(0) <= picked && picked < T(1);
  const T factor = select(is_whole, select(is_picked, part, T(0)), emphasis * part * share);
  const T largest = max_component(value) * factor;
  const T wide = minimum(sqrt(T(kWidened / kPi) / largest), room);
  // Another cone within its lamp has a fixed size.
  const auto is_smaller = T(1.0001) < times_cone(cone, cone.of_cones);
  const auto is_fixed = select(flat, select(is_whole, T(0), T(1)), select(is_smaller, T(1), T(0))) > T(0.5);
  const T chord =
      select(flat, select(is_whole, bounds, of_part), select(is_smaller, sqrt(within2), maximum(cone.chord, wide)));
  const T chord2 = chord * chord;
  // A cone that was moved aside is smaller, and carries the same light.
  const T extent = select(is_fixed, within2, chord2) * T(kPi);
  ToonLobe<T> out;
  out.whole = select(is_whole, T(1), T(0));
  // The angle 2 asin(chord / 2), with a relative error of 1e-4.
  out.size = chord * (T(2 / kPi) +
                      chord2 * (T(2 / kPi / 24) + chord2 * (T(2 / kPi * 3 / 640) + chord2 * T(2 / kPi * 5 / 7168))));
  out.color = value * (factor * extent * kept(largest * extent, u));
  return out;
}

/// The largest radius of a cone that is widened beyond its lamp.
inline constexpr double kWidestWidened = 0.3;

}  // namespace brdfc::forms
