// SPDX-License-Identifier: GPL-3.0-or-later
// What the form of nodes makes of lamps (nodes.cpp): cones of directions. Without Open Shading Language Cycles drops
// closures that take light away, so what a closure carries of a lamp has to be left out elsewhere and can't be taken
// off.
//
// Lamps: one Toon closure each, level over the cone that the lamp fills, with the model's f cos at a random point of
// it. Rest: a direction drawn from the model, which carries nothing where it lies in such a cone.
//
// A ball or a sun fills its cone. A rectangle or an ellipse does not: its cone is the widest that fits into it, and
// what it has beside that drawn directions meet. A closure of small weight is lost, so the cone of a small lamp is
// widened until it carries kWidened of the light: that much of what shines beside the lamp counts twice. Of two cones
// that overlap the earlier one, which the list has the wider lamps in, is left to drawn directions: both would count
// twice there.
#pragma once

#include "core/vec.h"
#include "model/model.h"

namespace brdfc::forms {

/// What a slot of a lamp holds: see brdfc_lamp() in osl/brdfc.osl.in, and blender_addon/lamps/slots.py.
template <class T> struct LampSlot { Vec3<T> place, turn, scale, shape; };

template <class T> struct LampCone {
  Vec3<T> towards;  ///< its axis, unit
  T angle;          ///< its radius, with a seam
  T drop;           ///< 1 - cos of that of the lamp within
  T widened;        ///< 1: may be wider than the lamp, else 0
  T active;         ///< 1; 0: the lamp is left to drawn directions, or the slot is empty
};

/// Half the width of the lobe of a drawn direction. It keeps off lamps by more than that.
inline constexpr double kNarrow = 1e-3;

/// At the point `at` for the viewer's direction wo, all in the world's axes.
template <class T> LampCone<T> cone_of(const LampSlot<T>& slot, const Vec3<T>& at, const Vec3<T>& wo) {
  /// Tangent of the radius from which on drawn directions meet a lamp well; what is left of a cone's normal's height
  /// over its rim, at least; the radius of what has no size.
  constexpr double kWidest = 1.5, kLeastRise = 0.01, kPoint = 1e-4;
  const T kind = slot.shape.x, w = slot.scale.z;
  const Vec3<T>&turn = slot.turn, &shape = slot.shape;
  const auto ball = kind < T(1.5);
  const auto sun = kind > T(1.5) && kind < T(2.5);
  const auto flat = kind > T(2.5) && kind < T(4.5);
  const auto sky = kind > T(4.5);
  const Vec3<T> axis = {T(2) * (turn.x * turn.z + w * turn.y), T(2) * (turn.y * turn.z - w * turn.x),
                        T(1) - T(2) * (turn.x * turn.x + turn.y * turn.y)};
  const T level = cos(turn.x);
  const Vec3<T> in_sky = {level * sin(turn.y), level * cos(turn.y), sin(turn.x)};
  const Vec3<T> centre = select(sky, in_sky, select(sun, axis, slot.place - at));
  const T distance = maximum(length(centre), tiny<T>());
  LampCone<T> cone;
  cone.towards = centre / distance;
  // Tangents of radii.
  const T sine = minimum(abs(shape.y) / distance, T(0.99));
  const T of_ball = sine / sqrt(T(1) - sine * sine);
  const T half = minimum(abs(shape.y) / T(2), T(1.5));
  const T of_sun = sin(half) / cos(half);
  const T a = abs(shape.y * slot.scale.x) / T(2), b = abs(shape.z * slot.scale.y) / T(2);
  // The widest cone about the centre within a disk: its rim touches that where the plane recedes.
  const T facing = dot(axis, cone.towards), slant = sqrt(maximum(T(1) - facing * facing, T(0)));
  const T within = minimum(a, b);
  const T of_flat = within * facing / (distance + within * slant);
  // One that drawn directions are not to meet is covered by the cone.
  const T covering = sqrt(a * a + b * b) / distance;
  const T tangent =
      maximum(select(ball, of_ball, select(flat, select(shape.y < T(0), covering, of_flat), of_sun)), T(kPoint));
  const T secant = sqrt(T(1) + tangent * tangent);
  cone.drop = tangent * tangent / (secant * (secant + T(1)));
  cone.angle = atan(tangent) + T(2 * kNarrow);
  cone.widened = select(flat, T(0), T(1));
  // Cosine between the closure's normal and its axis; all of the cone has to be above that normal's horizon.
  const T rise = length(cone.towards + wo) / T(2);
  const auto usable = kind > T(0.5) && tangent < T(kWidest) && rise > tangent / secant + T(kLeastRise);
  cone.active = select(usable && (!flat || facing > T(0.01)), T(1), T(0));
  return cone;
}

/// A direction within `drop` of the axis, each as likely as the others.
template <class T> Vec3<T> point_of(const Vec3<T>& towards, const T& drop, const T& u, const T& v) {
  const T q = u * drop, sine = sqrt(maximum(q * (T(2) - q), T(0))), turn = T(2) * pi<T>() * v;
  // about_axis() is for an axis in the upper half; a cone is the same in the mirror.
  const T up = select(towards.z < T(0), T(-1), T(1));
  const Vec3<T> p =
      about_axis(Vec3<T>{towards.x, towards.y, towards.z * up}, Vec3<T>{sine * cos(turn), sine * sin(turn), T(1) - q});
  return {p.x, p.y, p.z * up};
}

/// A closure of small weight, which Cycles would drop: kept by chance, and as much brighter then. `u` from 0 to 1.
template <class T> T kept(const T& weight, const T& u) {
  constexpr double kLeast = 1e-4;
  const T chance = weight / T(kLeast);
  return select(chance < T(1), select(u < chance, T(1) / maximum(chance, tiny<T>()), T(0)), T(1));
}

/// What a Toon closure takes that carries `value`, f cos, over the cone.
template <class T> struct ToonLobe {
  Rgb<T> color;
  T size;  ///< in units of 90 degrees, as the node has it
};
/// `room`: how wide it may be made without covering another lamp.
template <class T> ToonLobe<T> toon_lobe(const LampCone<T>& cone, const T& room, const Rgb<T>& value, const T& u) {
  constexpr double kWidened = 2e-4, kWidestWidened = 0.3;
  const T largest = max_component(value);
  const T wide = minimum(sqrt(T(kWidened / kPi) / maximum(largest, T(1e-6))), T(kWidestWidened));
  const T width = maximum(cone.angle, minimum(wide, room) * cone.widened);
  // Cycles' one_minus_cos() (util/math_base.h), rounding and all: its Toon closures divide by that.
  const T drop = select(width > T(0.02), T(1) - cos(width), width * width / T(2));
  const T extent = T(2) * pi<T>() * drop;
  ToonLobe<T> out;
  out.size = width * T(2 / kPi);
  out.color = value * (extent * kept(largest * extent, u));
  return out;
}

/// How far apart the tips of unit vectors are that are less than an angle from each other.
template <class T> T chord(const T& angle) { return T(2) * sin(angle / T(2)); }

}  // namespace brdfc::forms
