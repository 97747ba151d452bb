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
// lamp. An ellipse has the largest cone that fits into it. A rectangle has up to four in a row, along the axis that
// looks longer from the shading point. They may overlap, since only their sum counts. All of them carry the same value,
// so that the model's formula runs once. Cycles drops closures with a small weight, so the cone of a small lamp is
// widened until it carries kWidened of the light; that share of the light beside the lamp then counts twice. If the
// cones of two lamps overlap, light in the overlap would count twice. If one of them is a rectangle or an ellipse and
// the other is a much smaller ball or sun, as behind a window, the wide one has a cone beside the small one
// (cone_aside). Otherwise the earlier lamp in the list, which is sorted by size with the widest first, is left to drawn
// directions.
//
// The formulas run only as nodes (print/node_program.h), for which a division by 0 and the root of a negative number
// give 0.
#pragma once

#include "core/vec.h"
#include "model/model.h"

namespace brdfc::forms {

/// The contents of a lamp slot: see brdfc_lamp() in osl/brdfc.osl.in and blender_addon/lamps/slots.py. `kind` and
/// `most` come from shape.x.
template <class T> struct LampSlot {
  Vec3<T> place, turn, scale, shape;
  T kind;
  T most;  ///< the number of cones that the lamp may have
};

/// The orientation and size of a lamp, from its slot. It does not depend on the shading point, so Cycles computes it
/// once.
template <class T> struct LampAxes {
  Vec3<T> across, along, away;  ///< unit vectors; `away` points away from the shining side
  T half_across, half_along;    ///< half axes of a rectangle or an ellipse
};
template <class T> LampAxes<T> lamp_axes(const LampSlot<T>& slot) {
  const Vec3<T>& q = slot.turn;
  const T w = slot.scale.z;
  LampAxes<T> axes;
  axes.across = {T(1) - T(2) * (q.y * q.y + q.z * q.z), T(2) * (q.x * q.y + w * q.z), T(2) * (q.x * q.z - w * q.y)};
  axes.along = {T(2) * (q.x * q.y - w * q.z), T(1) - T(2) * (q.x * q.x + q.z * q.z), T(2) * (q.y * q.z + w * q.x)};
  axes.away = {T(2) * (q.x * q.z + w * q.y), T(2) * (q.y * q.z - w * q.x), T(1) - T(2) * (q.x * q.x + q.y * q.y)};
  axes.half_across = abs(slot.shape.y * slot.scale.x) / T(2);
  axes.half_along = abs(slot.shape.z * slot.scale.y) / T(2);
  return axes;
}

/// The cones of a rectangle, as seen from a shading point: equal ones in a row along the axis that looks longer.
template <class T> struct LampCones {
  T count;
  T sine;       ///< of their radius
  T alone;      ///< the sine of the radius of the largest cone about the middle of the lamp
  Vec3<T> row;  ///< half the distance between the middles of the first and the last
};
/// `centre`: from the shading point to the middle of the lamp. `many`: whether there may be more than one cone.
///
/// A cone lies within a rectangle if it lies on the inner side of the four planes through the shading point and an
/// edge. If A and B are half the lamp's axes and C is its middle, the plane through the edge at C + A has the normal
/// B x (C + A). So the sine of the angle between C and that plane is |det(A, B, C)| / (|C| |B x (C + A)|). For the
/// point C + tA of the lamp it is (1 - t) times that, with |C + tA| in place of |C|.
template <class T, class Bool> LampCones<T> cones_of_rectangle(const LampSlot<T>& slot, const LampAxes<T>& lamp,
                                                               const Vec3<T>& centre, const Bool& many) {
  // Of a rectangle that looks shorter than this, for its width, two cones cover hardly more than one.
  constexpr double kTwo = 1.1;
  const Vec3<T> a = lamp.across * lamp.half_across, b = lamp.along * lamp.half_along;
  const T a2 = sqr(lamp.half_across), b2 = sqr(lamp.half_along), c2 = dot(centre, centre);
  const T ac = abs(dot(a, centre)), bc = abs(dot(b, centre));
  // |B x (C + A)|^2 and |A x (C + B)|^2, at the end of each axis where they are larger.
  const T at_a2 = b2 * (c2 + a2 + T(2) * ac) - sqr(bc), at_b2 = a2 * (c2 + b2 + T(2) * bc) - sqr(ac);
  const auto a_is_longer = at_a2 < at_b2;
  const T longer2 = maximum(at_a2, at_b2), ratio = sqrt(longer2 / minimum(at_a2, at_b2));
  const auto more_than = [&](double limit) { return select(T(limit) < ratio, T(1), T(0)); };
  LampCones<T> cones;
  cones.count = select(many, minimum(slot.most, T(1) + more_than(kTwo) + more_than(2) + more_than(3)), T(1));
  const T moved = select(T(1.5) < cones.count, T(1) - T(1) / ratio, T(0));
  cones.row = select(a_is_longer, a, b) * moved;
  // All have the size of the farthest one.
  const T end2 = c2 + moved * (moved * select(a_is_longer, a2, b2) + T(2) * select(a_is_longer, ac, bc));
  const T volume = lamp.half_across * lamp.half_along * abs(dot(lamp.away, centre));
  cones.sine = volume / sqrt(longer2 * end2);
  cones.alone = volume / sqrt(longer2 * c2);
  return cones;
}

/// A lamp as seen from a shading point. Radii are given as chords (the distance between the tips of two unit vectors),
/// which take fewer nodes than angles.
template <class T> struct LampCone {
  Vec3<T> towards;     ///< unit vector to the middle of the lamp
  LampCones<T> cones;  ///< of a rectangle
  T drop;              ///< 1 - cos of the radius of the lamp, or of each of its cones
  T of_cones;          ///< solid angle of all cones
  T solid_angle;       ///< the same, or 0 for a lamp that drawn directions can't hit
  T chord;             ///< radius of the closure; for a ball or a sun it includes a seam
  T reach;             ///< radius of a cone around the whole lamp
  T inner;             ///< radius of the largest cone about its middle that a flat lamp fills
  T flat;              ///< 1 for a rectangle or an ellipse, otherwise 0
  T used;              ///< 0 for an empty slot, otherwise 1
  T active;            ///< 0 for an empty slot and for a lamp that is left to drawn directions, otherwise 1
  T above;             ///< 1 if a part of the lamp is above the horizon, otherwise 0
  T clear;             ///< the number of cones above the horizon, with fractions: see cone_at()
};

/// Half the width of the lobe of a drawn direction, which is also its minimum distance from lamps.
inline constexpr double kNarrow = 1e-3;

/// The cone of a lamp at the point `at`, for the viewer's direction wo and the normal of the horizon, all in world
/// coordinates. Cycles folds what depends only on the slot, so that a ball, a sun and a rectangle each take only the
/// nodes for their kind.
template <class T> LampCone<T> cone_of(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                                       const Vec3<T>& wo, const Vec3<T>& normal) {
  /// Squared sines of radii: kWidest is where drawn directions hit a lamp often enough (tangent 1.5), kPoint is the
  /// size given to lamps without size. kLeastRise is the minimum height of the cone's rim over the horizon of the
  /// closure's normal.
  constexpr double kWidest = 2.25 / 3.25, kPoint = 1e-8, kLeastRise = 0.01;
  const T kind = slot.kind;
  const auto ball = kind < T(1.5);
  const auto sun = kind > T(1.5) && kind < T(2.5);
  const auto flat = kind > T(2.5) && kind < T(4.5);
  const auto sky = kind > T(4.5);
  const T level = cos(slot.turn.x);
  const Vec3<T> in_sky = {level * sin(slot.turn.y), level * cos(slot.turn.y), sin(slot.turn.x)};
  const Vec3<T> centre = select(sky, in_sky, select(sun, lamp.away, slot.place - at));
  const T distance2 = dot(centre, centre), nearness = T(1) / sqrt(distance2);
  LampCone<T> cone;
  cone.towards = centre * nearness;
  // Squared sines of the radii.
  const T of_ball = sqr(slot.shape.y) / distance2;
  const T of_sun = sqr(sin(minimum(abs(slot.shape.y) / T(2), T(1.5))));
  // Twice the squared cosine between the closure's normal and the cone's axis. The whole cone has to be above the
  // horizon of that normal, and so does each of several.
  const T rise2 = T(2) * dot(cone.towards, wo) + T(2);
  const T diagonal = sqrt(sqr(lamp.half_across) + sqr(lamp.half_along)) * nearness;
  const auto stays_above = [&](const T& sine, const T& reach) {
    return rise2 > sqr(T(2) * sine + T(2 * kLeastRise) + reach);
  };
  const T height_of_lamp = dot(lamp.away, centre), facing = height_of_lamp * nearness;
  const T narrower = minimum(lamp.half_across, lamp.half_along) * nearness;
  cone.cones = cones_of_rectangle(slot, lamp, centre, T(1.5) < slot.most && stays_above(narrower, diagonal));
  // The largest cone about the centre that fits within a disk: its rim touches the disk where the plane recedes.
  const T tangent = narrower * facing / (T(1) + narrower * sqrt(T(1) - facing * facing)), tangent2 = tangent * tangent;
  const T of_flat = select(kind < T(3.5), sqr(cone.cones.sine), tangent2 / (T(1) + tangent2));
  const T size2 = select(ball, of_ball, select(flat, of_flat, of_sun));
  const T sine2 = maximum(size2, T(kPoint));
  cone.drop = sine2 / (T(1) + sqrt(T(1) - sine2));
  cone.of_cones = cone.cones.count * cone.drop * T(2 * kPi);
  // blender_addon/lamps/slots.py: the first size is negative for lamps that drawn directions don't hit.
  const auto hit = size2 > T(kPoint) && T(0) < slot.shape.y;
  cone.solid_angle = select(hit, cone.of_cones, T(0));
  // The cones of a rectangle carry all of the rectangle's light, so they must not be widened.
  cone.chord = sqrt(T(2) * cone.drop) + select(flat, T(0), T(2 * kNarrow));
  cone.reach = select(flat, diagonal + T(2 * kNarrow), cone.chord);
  const T inner2 = select(kind < T(3.5), sqr(cone.cones.alone), size2);
  cone.inner = sqrt(T(2) * inner2 / (T(1) + sqrt(T(1) - inner2)));
  cone.flat = select(flat, T(1), T(0));
  cone.cones.sine = sqrt(sine2);
  const auto used = kind > T(0.5);
  const auto usable = used && sine2 < T(kWidest) && stays_above(cone.cones.sine, T(0));
  const auto shines_here = select(flat, facing, T(1)) > T(0.01);
  cone.used = select(used, T(1), T(0));
  cone.active = select(usable && shines_here, T(1), T(0));
  cone.above = select(T(0) < dot(cone.towards, normal) + cone.reach, T(1), T(0));
  return cone;
}

/// One of the cones of a lamp, counted from 0.
template <class T> struct ConeAt {
  Vec3<T> towards;  ///< unit vector along its axis
  T clear;          ///< the part of it that is above the horizon, or 0 if the lamp does not have so many cones
};
/// `true_normal`: of the surface, which hides what is below it. Directions below a shading normal alone are not hidden,
/// so f = 0 there already accounts for them.
template <class T> ConeAt<T> cone_at(const LampSlot<T>& slot, const LampCone<T>& cone, const Vec3<T>& at,
                                     const T& index, const Vec3<T>& true_normal) {
  const LampCones<T>& of = cone.cones;
  const T along_row = T(2) * index / (of.count - T(1)) - T(1);
  const Vec3<T> middle = slot.place - at + of.row * along_row;
  ConeAt<T> out;
  out.towards = select(T(1.5) < slot.most, middle * (T(1) / sqrt(dot(middle, middle))), cone.towards);
  // This approximates the part of a disk above a line, to 0.02.
  const T height = maximum(minimum(dot(out.towards, true_normal) / of.sine, T(1)), T(-1));
  const T part = height * (T(0.75) - T(0.25) * (height * height)) + T(0.5);
  out.clear = select(index < of.count, part, T(0));
  return out;
}

/// The solid angle that a point of a rectangle or an ellipse stands for, divided by `of_cones`, that of all cones
/// within the lamp. `cosine`: between `away` and the direction to the point, whose squared distance is given.
template <class T> T emphasis_at(const LampSlot<T>& slot, const LampAxes<T>& lamp, const T& cosine, const T& distance2,
                                 const T& of_cones) {
  const auto round = slot.kind > T(3.5);
  const T area = lamp.half_across * lamp.half_along * select(round, T(kPi), T(4));
  return area * cosine / (distance2 * of_cones);
}

/// A cone within a flat lamp, beside a small lamp in front of it or behind it.
template <class T> struct ConeAside {
  Vec3<T> towards;  ///< unit vector along its axis
  T chord;          ///< its radius
  T clear;          ///< LampCone::clear, more than 1 by the share of the flat lamp that the small one covers
  T fits;           ///< 1 if the other lamp is small enough, otherwise 0
};
/// Where a direction meets the plane of a rectangle or an ellipse.
template <class T> struct PlanePoint {
  T slope;      ///< cosine between the direction and `away`: positive where the shining side is seen
  T distance;   ///< from the shading point
  Vec3<T> off;  ///< from the middle of the lamp
};
template <class T> PlanePoint<T> plane_point(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                                             const Vec3<T>& direction) {
  const Vec3<T> centre = slot.place - at;
  PlanePoint<T> out;
  out.slope = dot(lamp.away, direction);
  out.distance = dot(lamp.away, centre) / out.slope;
  out.off = direction * out.distance - centre;
  return out;
}

/// The part of a small disk of directions about `other` that lies within a rectangle or an ellipse.
template <class T> T part_within(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                                 const Vec3<T>& other, const T& other_radius) {
  const PlanePoint<T> p = plane_point(slot, lamp, at, other);
  const T diameter = T(2) * other_radius * p.distance;
  const auto within = [&](const T& left) { return maximum(minimum(left / diameter + T(0.5), T(1)), T(0)); };
  const T x = dot(p.off, lamp.across), y = dot(p.off, lamp.along);
  const T of_rectangle = within(lamp.half_across - abs(x)) * within(lamp.half_along - abs(y));
  const T from_middle = sqrt(sqr(x / lamp.half_across) + sqr(y / lamp.half_along));
  const T of_ellipse = within((T(1) - from_middle) * minimum(lamp.half_across, lamp.half_along));
  return select(T(0) < p.slope, select(slot.kind > T(3.5), of_ellipse, of_rectangle), T(0));
}
/// The largest disk within a disk of radius `inner` about `towards` that does not meet one of radius `other_radius`
/// about `other`: it touches the rims of both. Radii and distances are chords.
template <class T> ConeAside<T> cone_aside(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                                           const Vec3<T>& towards, const T& inner, const Vec3<T>& other,
                                           const T& other_radius) {
  /// Of the radius of the wide lamp, the largest radius that the small one may have.
  constexpr double kSmall = 1.0 / 3;
  /// Chords add up only approximately, and both lamps have a seam.
  constexpr double kMargin = 0.97;
  const Vec3<T> away = towards - other;
  const T distance = length(away);
  ConeAside<T> out;
  out.chord = minimum((inner + distance - other_radius) / T(2), inner) * T(kMargin);
  const Vec3<T> middle = towards + away * ((inner - out.chord) / distance);
  out.towards = middle * (T(1) / length(middle));
  // Light samples of the wide lamp that meet the cone of the small one have light there.
  const Vec3<T> centre = slot.place - at;
  const T distance2 = dot(centre, centre), facing = abs(dot(lamp.away, centre)) / sqrt(distance2);
  const T whole = emphasis_at(slot, lamp, facing, distance2, T(1));
  const T covered = part_within(slot, lamp, at, other, other_radius) * (sqr(other_radius) * T(kPi)) / whole;
  out.clear = T(1) / (T(1) - covered);
  out.fits = select(other_radius < inner * T(kSmall), T(1), T(0));
  return out;
}

/// A point of a rectangle or an ellipse, chosen by two numbers in [0, 1).
template <class T> struct FlatPoint {
  Vec3<T> wi;  ///< unit vector to the point
  T emphasis;  ///< emphasis_at() the point
};
template <class T> FlatPoint<T> flat_point(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at,
                                           const T& of_cones, const T& u, const T& v) {
  const auto round = slot.kind > T(3.5);
  const T radius = sqrt(u), turn = T(2) * pi<T>() * v;
  const T x = select(round, radius * cos(turn), T(2) * u - T(1));
  const T y = select(round, radius * sin(turn), T(2) * v - T(1));
  const Vec3<T> p = lamp.across * (lamp.half_across * x) + lamp.along * (lamp.half_along * y) + (slot.place - at);
  const T distance2 = dot(p, p);
  FlatPoint<T> out;
  out.wi = p * (T(1) / sqrt(distance2));
  const T cosine = maximum(dot(lamp.away, out.wi), T(0));
  out.emphasis = emphasis_at(slot, lamp, cosine, distance2, of_cones);
  return out;
}

/// The part of f cos in one direction that the lamp's closure carries; the drawn direction carries the rest of it.
/// `density`: pdf of drawn directions there. `emphasis`: 1 for a ball or a sun.
///
/// Cycles follows one closure at a time, so the part of a drawn direction is noisy unless it is small or nearly
/// everything. The closure is only as noisy as f is uneven over the lamp. So it keeps its light until drawn directions
/// hit the lamp so often that the lobe must be narrower than the lamp, and then gives it up quickly.
template <class T> T part_of_lamp(const LampCone<T>& cone, const T& emphasis, const T& density) {
  /// Where both carry one half: the density, in units of that of a uniform point of the lamp.
  constexpr double kEqual = 2;
  // The point of a rectangle has the pdf 1 / (solid_angle emphasis), and since Cycles samples all of the rectangle,
  // only one sample in `emphasis` meets its cone.
  const T ratio = density * (cone.solid_angle * sqr(emphasis)) * T(1 / kEqual);
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
  const T emphasis = emphasis_at(slot, lamp, p.slope, sqr(p.distance), cone.solid_angle);
  return met * part_of_lamp(cone, select(flat, emphasis, T(1)), density);
}

/// Russian roulette for a closure with a small weight, which Cycles would drop: it is kept at random, with a weight
/// increased accordingly. `u` is from 0 to 1.
template <class T> T kept(const T& weight, const T& u) {
  constexpr double kLeast = 1e-4;
  const T chance = weight * T(1 / kLeast);
  return select(u < chance, T(1), T(0)) / minimum(chance, T(1));
}

/// The inputs of the Toon closures, one for each cone, that carry `value`, as f cos, over it: as much of it as
/// part_of_lamp() says. For a ball or a sun the closure may be wider than the cone.
template <class T> struct ToonLobe {
  Rgb<T> color;
  T size;  ///< in units of 90 degrees, as in the node
};
/// `room`: the radius that it may have without covering another lamp. `emphasis`, `density`: at the point where the
/// value is taken.
template <class T> ToonLobe<T> toon_lobe(const LampCone<T>& cone, const T& emphasis, const T& density, const T& room,
                                         const Rgb<T>& value, const T& u) {
  constexpr double kWidened = 2e-4;
  // f is averaged over the whole lamp, with zeros below the horizon, and the surface hides that part of the cones. If a
  // smaller part of them is above the horizon, light is lost; otherwise few samples would have to carry it.
  constexpr double kLeastPart = 0.05;
  const T whole = cone.cones.count / maximum(cone.clear, T(kLeastPart) * cone.cones.count);
  const T factor = emphasis * whole * part_of_lamp(cone, emphasis, density);
  const T largest = max_component(value) * factor;
  const T wide = minimum(sqrt(T(kWidened / kPi) / largest), room);
  const auto is_flat = cone.flat > T(0.5);
  const T chord = maximum(cone.chord, select(is_flat, T(0), wide)), chord2 = chord * chord;
  // A cone that was moved aside is smaller, and carries the same light.
  const T extent = select(is_flat, cone.of_cones / cone.cones.count, chord2 * T(kPi));
  ToonLobe<T> out;
  // The angle 2 asin(chord / 2), with a relative error of 1e-4.
  out.size = chord * (T(2 / kPi) +
                      chord2 * (T(2 / kPi / 24) + chord2 * (T(2 / kPi * 3 / 640) + chord2 * T(2 / kPi * 5 / 7168))));
  out.color = value * (factor * extent * kept(largest * extent, u));
  return out;
}

/// The largest radius of a cone that is widened beyond its lamp.
inline constexpr double kWidestWidened = 0.3;

}  // namespace brdfc::forms
