// SPDX-License-Identifier: GPL-3.0-or-later
// A lamp of the form made of nodes, as seen from a shading point: as cones of directions. node_lamps.h says what
// closures carry over them.
//
// The formulas run only as nodes (print/node_program.h), for which a division by 0 and the root of a negative number
// give 0.
#pragma once

#include <cmath>

#include "core/vec.h"
#include "forms/node_light.h"

namespace brdfc::forms {

/// How the cones of a flat lamp are arranged: 1 to 4 of them in a row along the axis `across`, or -2 to -4 along the
/// axis `along`, or kGrid for two by two.
inline constexpr double kGrid = 8;
template <class T> auto in_grid(const T& layout) { return T(kGrid / 2) < layout; }
template <class T> T count_of(const T& layout) { return select(in_grid(layout), T(4), abs(layout)); }

/// The distance of the farthest point of a flat lamp from its middle.
template <class T> T farthest_of(const LampSlot<T>& slot, const LampAxes<T>& lamp) {
  const T corner = sqrt(sqr(lamp.half_across) + sqr(lamp.half_along));
  return select(T(3.5) < slot.kind, maximum(lamp.half_across, lamp.half_along), corner);
}

/// In the unit circle, the radius of four circles that touch it and each other, and the coordinates of their middles.
inline constexpr double kQuarter = 0.41421356;

/// The cones of a flat lamp, as seen from a shading point.
template <class T> struct LampCones {
  T layout;
  T count;  ///< count_of(layout), which Cycles would keep for each lamp
  T scale;  ///< their size in units of that of one cone
  T alone;  ///< for a rectangle, the sine of the radius of the largest cone about its middle
  T moved;  ///< from the middle of the lamp to those of the outermost cones, in units of the half axis, divided by the
            ///< distance of the lamp
};
/// `centre`: from the shading point to the middle of the lamp. `many`: whether there may be more than one cone. `wide`:
/// whether the model varies over the lamp.
///
/// A cone lies within a rectangle if it lies on the inner side of the four planes through the shading point and an
/// edge. If A and B are half the lamp's axes and C is its middle, the plane through the edge at C + A has the normal
/// B x (C + A). So the sine of the angle between C and that plane is |det(A, B, C)| / (|C| |B x (C + A)|). For the
/// point C + tA of the lamp it is (1 - t) times that, with |C + tA| in place of |C|.
template <class T, class Many, class Wide> LampCones<T> cones_of_flat(const LampSlot<T>& slot, const LampAxes<T>& lamp,
                                                                      const Vec3<T>& centre, const Many& many,
                                                                      const Wide& wide) {
  // Of a rectangle that looks shorter than kTwo, for its width, two cones in a row cover hardly more than one; of one
  // that looks longer than kLong, two by two cover less than a row.
  constexpr double kTwo = 1.1, kLong = 1.5;
  const Vec3<T> a = lamp.across * lamp.half_across, b = lamp.along * lamp.half_along;
  const T a2 = sqr(lamp.half_across), b2 = sqr(lamp.half_along), c2 = dot(centre, centre);
  const T ac = abs(dot(a, centre)), bc = abs(dot(b, centre));
  // |B x (C + A)|^2 and |A x (C + B)|^2, at the end of each axis where they are larger.
  const T at_a2 = b2 * (c2 + a2 + T(2) * ac) - sqr(bc), at_b2 = a2 * (c2 + b2 + T(2) * bc) - sqr(ac);
  const auto a_is_longer = at_a2 < at_b2;
  const T longer2 = maximum(at_a2, at_b2), ratio = sqrt(longer2 / minimum(at_a2, at_b2));
  const auto more_than = [&](double limit) { return select(T(limit) < ratio, T(1), T(0)); };
  LampCones<T> cones;
  const auto round = T(3.5) < slot.kind;
  const auto grid = many && wide && T(3.5) < slot.most && ratio < T(kLong);
  const T in_row =
      select(many && !round, minimum(slot.most, T(1) + more_than(kTwo) + more_than(2) + more_than(3)), T(1));
  const T row = select(T(1.5) < in_row, T(1) - T(1) / ratio, T(0));
  cones.layout = select(many, select(grid, T(kGrid), select(a_is_longer, in_row, -in_row)), T(1));
  cones.count = select(grid, T(4), in_row);
  const T half = select(round, T(kQuarter), T(0.5));
  cones.scale = select(grid, half, T(1));
  cones.moved = select(grid, half, row) / sqrt(c2);
  const T volume = lamp.half_across * lamp.half_along * abs(dot(lamp.away, centre));
  cones.alone = volume / sqrt(longer2 * c2);
  return cones;
}

/// A lamp as seen from a shading point. Radii are given as chords (the distance between the tips of two unit vectors),
/// which take fewer nodes than angles.
template <class T> struct LampCone {
  Vec3<T> towards;     ///< unit vector to the middle of the lamp, for a rectangle that of its part above the horizon
  Vec3<T> aim;         ///< unit vector along the axis of a single cone, which may be within the lamp
  LampCones<T> cones;  ///< of a flat lamp
  T part_across, part_along;  ///< see Risen; 1 for other lamps
  T drop;                     ///< 1 - cos of the radius of a ball or a sun
  T of_cones;                 ///< solid angle of all cones, if they were in the middle of the lamp
  T chord;                    ///< radius of a ball or a sun, with a seam
  T reach;                    ///< radius of a cone around the whole lamp
  T inner;                    ///< radius of the largest cone about its middle that a flat lamp fills
  T flat;                     ///< 1 for a rectangle or an ellipse, otherwise 0
  T used;                     ///< 0 for an empty slot, otherwise 1
  T active;                   ///< 0 for an empty slot and for a lamp that is left to drawn directions, otherwise 1
  T above;                    ///< 1 if a part of the lamp is above the horizon, otherwise 0
  T clear;                    ///< divides the light: see cone_of() and cone_aside()
};

/// The sine of the radius of the widest cone.
inline constexpr double kWidest = 0.832;
/// Half the width of the lobe of a drawn direction, which is also its minimum distance from lamps.
inline constexpr double kNarrow = 1e-3;

/// The part of a rectangle above the horizon of `normal`: a rectangle with the same edges or, where the horizon crosses
/// edges that meet, the smallest one that contains the part.
template <class T> struct Risen {
  Vec3<T> place;
  T half_across, half_along;
  T part_across, part_along;  ///< of the whole lamp's axes, negative where their ends are the ones that are left
  T cut;                      ///< 1 if this is less than the whole lamp, otherwise 0
  T level;                    ///< 1 if nothing of this is below the horizon, otherwise 0
};
template <class T>
Risen<T> risen(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at, const Vec3<T>& normal) {
  constexpr double kAbove = 0.98, kThinnest = 1e-3, kWhole = 0.9999;
  const T a = dot(lamp.across, normal) * lamp.half_across, b = dot(lamp.along, normal) * lamp.half_along;
  const T rise_a = abs(a), rise_b = abs(b), middle = dot(slot.place - at, normal);
  // The part of an axis where, at the best point of the other axis, the lamp is above the horizon.
  const auto part = [&](const T& own, const T& other) {
    const T from_end = (middle + other) / maximum(own, tiny<T>()) + T(1);
    return maximum(minimum(from_end / T(2), T(1)), T(kThinnest));
  };
  const T of_a = part(rise_a, rise_b), of_b = part(rise_b, rise_a);
  const auto moved = [](const T& rise, const T& half, const T& part) {
    return select(rise < T(0), T(-1), T(1)) * (half - half * part);
  };
  Risen<T> out;
  out.half_across = lamp.half_across * of_a;
  out.half_along = lamp.half_along * of_b;
  out.place =
      slot.place + lamp.across * moved(a, lamp.half_across, of_a) + lamp.along * moved(b, lamp.half_along, of_b);
  const T top = middle + rise_a + rise_b, depth = T(2) * (rise_a * of_a + rise_b * of_b);
  out.part_across = of_a * select(a < T(0), T(-1), T(1));
  out.part_along = of_b * select(b < T(0), T(-1), T(1));
  out.cut = select(of_a * of_b < T(kWhole), T(1), T(0));
  out.level = select(depth * T(kAbove) < top, T(1), T(0));
  return out;
}

/// The cone of a lamp at the point `at`, for the viewer's direction wo and the normal of the surface, all in world
/// coordinates. Cycles folds what depends only on the slot, so that a ball, a sun and a rectangle each take only the
/// nodes for their kind.
///
/// The surface hides what is below its horizon. There is no light in that part of a cone, or in Blender 4.5, beside an
/// open surface, light that does not belong to it. So a cone that the horizon cuts is replaced by the largest one
/// between the horizon and its highest point. Directions below a shading normal alone are not hidden, so f = 0 there
/// already accounts for them.
template <class T> LampCone<T> cone_of(const LampSlot<T>& given, const LampAxes<T>& whole, const Vec3<T>& at,
                                       const Vec3<T>& wo, const Vec3<T>& normal) {
  /// kPoint is the sine of the radius of lamps without size. kInside is the squared sine of a ball from which drawn
  /// directions meet it often enough. kLeastRise is the minimum height of the cone's rim over the horizon of the
  /// closure's normal.
  constexpr double kInside = 0.95, kPoint = 1e-4, kLeastRise = 0.01;
  // f is averaged over the whole lamp, with zeros below the horizon. If a smaller part of a mesh is above the horizon,
  // light is lost; otherwise few samples would have to carry it.
  constexpr double kLeastPart = 0.05;
  // Half the diagonal of a rectangle over its distance, above which it has two cones by two.
  constexpr double kWide = 0.1;
  const T kind = given.kind;
  const auto ball = kind < T(1.5);
  const auto sun = kind > T(1.5) && kind < T(2.5);
  const auto flat = kind > T(2.5) && kind < T(4.5);
  const auto rectangle = kind > T(2.5) && kind < T(3.5);
  const auto sky = kind > T(4.5);
  const Risen<T> part = risen(given, whole, at, normal);
  LampSlot<T> slot = given;
  slot.place = select(rectangle, part.place, given.place);
  LampAxes<T> lamp = whole;
  lamp.half_across = select(rectangle, part.half_across, whole.half_across);
  lamp.half_along = select(rectangle, part.half_along, whole.half_along);
  const T level = cos(slot.turn.x);
  const Vec3<T> in_sky = {level * sin(slot.turn.y), level * cos(slot.turn.y), sin(slot.turn.x)};
  const Vec3<T> centre = select(sky, in_sky, select(sun, lamp.away, slot.place - at));
  const T distance2 = dot(centre, centre), nearness = T(1) / sqrt(distance2);
  LampCone<T> cone;
  cone.part_across = select(rectangle, part.part_across, T(1));
  cone.part_along = select(rectangle, part.part_along, T(1));
  cone.towards = centre * nearness;
  // Squared sines of the radii.
  // Lamps with soft falloff are disks that face the surface. The second scale is 0 for a sphere and for a mesh.
  const T radius2 = sqr(slot.shape.y);
  const T of_ball = radius2 / (distance2 + select(T(0) < abs(slot.scale.y), radius2, T(0)));
  const T of_sun = sqr(sin(minimum(abs(slot.shape.y) / T(2), T(1.5))));
  const T diagonal = farthest_of(slot, lamp) * nearness;
  const T height_of_lamp = dot(lamp.away, centre), facing = height_of_lamp * nearness;
  const T narrower = minimum(lamp.half_across, lamp.half_along) * nearness;
  // Half the length of the sum of the cone's axis and the viewer's direction is the cosine between the axis and the
  // closure's normal. The whole cone has to be above the horizon of that normal; if there are several, each of them. An
  // axis that is raised from the horizon, see below, only increases that cosine where it is small.
  const T above_closure = sqrt(T(0.5) * dot(cone.towards, wo) + T(0.5)) - T(kLeastRise);
  const auto several = T(1.5) < slot.most && T(0.5) < part.level && above_closure > narrower + diagonal * T(0.5);
  cone.cones = cones_of_flat(slot, lamp, centre, several, T(kWide) < diagonal);
  // The largest cone about the centre that fits within a disk: its rim touches the disk where the plane recedes.
  const auto in_disk = [&](const T& radius) {
    const T tangent2 = sqr(radius * facing / (T(1) + radius * sqrt(T(1) - facing * facing)));
    return tangent2 / (T(1) + tangent2);
  };
  const T of_flat = select(rectangle, sqr(cone.cones.alone * cone.cones.scale), in_disk(narrower * cone.cones.scale));
  const T size2 = select(ball, of_ball, select(flat, of_flat, of_sun));
  const T size = maximum(sqrt(size2), T(kPoint));
  // blender_addon/lamps/kinds: the first scale is 0 for a mesh, which need not fill its ball.
  const auto solid = !ball || T(0) < abs(slot.scale.x);
  // Between the horizon and the highest point, at `height` + `size`.
  const T height = dot(cone.towards, normal);
  const T risen_size = select(solid, minimum(size, (height + size) / T(2)), size), lift = size - risen_size;
  const Vec3<T> lifted = cone.towards + normal * lift;
  const T shorter = T(1) / sqrt(dot(lifted, lifted));
  cone.aim = lifted * shorter;
  const T room = minimum(above_closure, T(kWidest));
  const T sine = maximum(minimum(risen_size * shorter, room), select(flat, T(kPoint), T(kNarrow)));
  const auto drop_of = [](const T& sine2) { return sine2 / (T(1) + sqrt(T(1) - sine2)); };
  const T whole_drop = drop_of(sqr(size)), drop = drop_of(sqr(sine));
  cone.drop = whole_drop;
  cone.of_cones = cone.cones.count * drop * T(2 * kPi);
  cone.chord = sqrt(T(2) * whole_drop) + T(2 * kNarrow);
  cone.reach = select(flat, diagonal + T(2 * kNarrow), cone.chord) + lift;
  const T inner = select(lift < T(kPoint) && !(rectangle && T(0.5) < part.cut),
                         minimum(select(kind < T(3.5), cone.cones.alone, sqrt(in_disk(narrower))), room), T(0));
  cone.inner = sqrt(T(2) * drop_of(sqr(inner)));
  cone.flat = select(flat, T(1), T(0));
  const auto used = kind > T(0.5);
  const auto usable = used && select(solid, T(kLeastRise), size) < room && select(flat, T(0), size2) < T(kInside);
  const auto shines_here = select(flat, facing, T(1)) > T(0.01);
  cone.used = select(used, T(1), T(0));
  cone.active = select(usable && shines_here, T(1), T(0));
  cone.above = select(T(0) < height + size, T(1), T(0));
  // This approximates the part of a disk above a line, to 0.02.
  const T h = maximum(minimum(height / size, T(1)), T(-1));
  const T clear = h * (T(0.75) - T(0.25) * (h * h)) + T(0.5);
  cone.clear = select(solid, T(1), maximum(clear, T(kLeastPart)));
  return cone;
}

/// The solid angle of a ball or a sun, divided by that of its cone.
template <class T> T times_cone(const LampCone<T>& cone, const T& of_cones) {
  return maximum(cone.drop * T(2 * kPi) / of_cones, T(1));
}

/// One of a lamp's cones, which stands for a part of the lamp.
template <class T> struct LampPart {
  T index;          ///< from 0
  T across, along;  ///< -1 or 1: where it is among two by two
};

/// A cone of a lamp.
template <class T> struct ConeOfPart {
  Vec3<T> axis;
  T chord;  ///< its radius
};
template <class T> ConeOfPart<T> cone_at(const LampSlot<T>& slot, const LampAxes<T>& lamp, const LampCone<T>& cone,
                                         const LampPart<T>& part) {
  const T layout = cone.cones.layout;
  const auto grid = in_grid(layout), along = layout < T(0);
  const T in_row = T(2) * part.index / (abs(layout) - T(1)) - T(1);
  const T x = select(grid, part.across, select(along, T(0), in_row)) * abs(cone.part_across);
  const T y = select(grid, part.along, select(along, in_row, T(0))) * abs(cone.part_along);
  const Vec3<T> axis =
      cone.aim + (lamp.across * (lamp.half_across * x) + lamp.along * (lamp.half_along * y)) * cone.cones.moved;
  const T shorter = T(1) / sqrt(dot(axis, axis));
  // The nearer a part is, the larger it looks. That of an ellipse also looks narrower, the farther it is.
  const T nearer2 = sqr(shorter) * select(T(3.5) < slot.kind, minimum(sqr(shorter), T(1)), T(1));
  const T middle2 = cone.of_cones / (count_of(layout) * T(kPi));
  const T sine2 = minimum(middle2 * (T(1) - middle2 / T(4)) * nearer2, T(kWidest * kWidest));
  const T chord2 = T(2) * sine2 / (T(1) + sqrt(T(1) - sine2));
  const auto several = T(1.5) < slot.most && T(1.5) < count_of(layout);
  return {select(several, axis * shorter, cone.aim), sqrt(select(several, chord2, middle2))};
}

/// The solid angle that a point of a rectangle or an ellipse stands for, divided by `of_cones`, that of all cones
/// within the lamp. `cosine`: between `away` and the direction to the point, whose squared distance is given.
template <class T> T emphasis_at(const LampSlot<T>& slot, const LampAxes<T>& lamp, const T& cosine, const T& distance2,
                                 const T& of_cones) {
  const auto round = slot.kind > T(3.5);
  const T area = lamp.half_across * lamp.half_along * select(round, T(kPi), T(4));
  return area * cosine / (distance2 * of_cones);
}

/// The part of a flat lamp in which its points are chosen.
template <class T> T part_of_area(const LampCone<T>& cone) { return abs(cone.part_across * cone.part_along); }

/// A cone within a flat lamp, beside a small lamp in front of it or behind it.
template <class T> struct ConeAside {
  Vec3<T> towards;  ///< unit vector along its axis
  T of_cones;       ///< its solid angle
  T clear;          ///< LampCone::clear
  T fits;           ///< 1 if the other lamp is small enough, otherwise 0
};
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
  const T chord = minimum((inner + distance - other_radius) / T(2), inner) * T(kMargin);
  out.of_cones = sqr(chord) * T(kPi);
  const Vec3<T> middle = towards + away * ((inner - chord) / distance);
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

}  // namespace brdfc::forms
