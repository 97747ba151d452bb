// SPDX-License-Identifier: GPL-3.0-or-later
// A lamp of the form made of nodes: what its slot contains, and how much of its light reaches a shading point from a
// direction. node_cones.h says which directions it is seen in.
//
// The formulas run only as nodes (print/node_program.h), for which a division by 0 and the root of a negative number
// give 0.
#pragma once

#include <cmath>

#include "core/vec.h"
#include "forms/spot_falloff.h"

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

/// An area lamp with a Spread shines within a cone about its normal, as through a grid of slats (Cycles:
/// kernel/light/area.h). A point of it shines in proportion to 1 - t / m: t is the tangent of the angle between the
/// normal and the direction to the shading point, m that of half the Spread.
template <class T> struct Spread {
  decltype(T(0) > T(0)) is_narrow;  ///< whether the lamp has one that is less than half a turn
  T widest;                         ///< m

  /// 0 from behind: mean_light() looks a little beside the directions in which the lamp is seen.
  T light(const T& cosine) const {
    constexpr double kGrazing = 1e-3;
    const T c = maximum(cosine, T(kGrazing));
    return select(is_narrow, maximum(T(1) - sqrt(maximum(T(1) - sqr(c), T(0))) / (c * widest), T(0)), T(1));
  }
};
template <class T> Spread<T> spread_of(const LampSlot<T>& slot) {
  // A lamp with a Spread of 0 shines, too. Only the ratio of its light at two points matters here.
  constexpr double kLeast = 0.02;
  // 0.499 minus 0.998 times the spread in turns: see brdfc_lamp() in osl/brdfc.osl.in.
  const T lacking = slot.kind - select(T(3.5) < slot.kind, T(4), T(3)), angle = lacking * T(kPi / 0.998);
  return {T(2.5) < slot.kind && slot.kind < T(4.5) && T(1e-4) < lacking, maximum(cos(angle) / sin(angle), T(kLeast))};
}

/// The rectangle, or the ellipse, of a flat lamp with a Spread that bounds the part that shines on a shading point; for
/// other lamps all of it.
template <class T> struct LitArea {
  Vec3<T> place;
  T half_across, half_along;
  T is_lit;  ///< 1, or 0 if no part shines there

  LampSlot<T> of(LampSlot<T> slot) const {
    slot.place = place;
    return slot;
  }
  LampAxes<T> of(LampAxes<T> lamp) const {
    lamp.half_across = half_across;
    lamp.half_along = half_along;
    return lamp;
  }
};
/// The part that shines is where the lamp meets a disk in its plane, about the foot of the perpendicular from the
/// shading point.
template <class T> LitArea<T> lit_area(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at) {
  constexpr double kThinnest = 1e-3;
  const Spread<T> spread = spread_of(slot);
  const Vec3<T> centre = slot.place - at;
  const T x = -dot(centre, lamp.across), y = -dot(centre, lamp.along);
  const T radius2 = sqr(maximum(dot(centre, lamp.away), T(0)) * spread.widest);
  const T beside_x = maximum(abs(x) - lamp.half_across, T(0)), beside_y = maximum(abs(y) - lamp.half_along, T(0));
  struct Range {
    T middle, half;
  };
  const auto range = [&](const T& foot, const T& reach2, const T& half) {
    const T reach = sqrt(maximum(reach2, T(0)));
    const auto within = [&](const T& end) { return maximum(minimum(end, half), -half); };
    const T low = within(foot - reach), high = within(foot + reach);
    return Range{(low + high) / T(2), maximum((high - low) / T(2), half * T(kThinnest))};
  };
  const Range across = range(x, radius2 - sqr(beside_y), lamp.half_across);
  const Range along = range(y, radius2 - sqr(beside_x), lamp.half_along);
  const auto chosen = [&](const T& part, const T& whole) { return select(spread.is_narrow, part, whole); };
  LitArea<T> out;
  out.place =
      select(spread.is_narrow, slot.place + lamp.across * across.middle + lamp.along * along.middle, slot.place);
  out.half_across = chosen(across.half, lamp.half_across);
  out.half_along = chosen(along.half, lamp.half_along);
  out.is_lit = chosen(select(sqr(beside_x) + sqr(beside_y) < radius2, T(1), T(0)), T(1));
  return out;
}

/// The light of a flat lamp that reaches a shading point from the direction wi, in units of the lamp's greatest: 0 from
/// outside of an ellipse.
template <class T>
T light_from(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& at, const Vec3<T>& wi) {
  const Spread<T> spread = spread_of(slot);
  const PlanePoint<T> p = plane_point(slot, lamp, at, wi);
  const T from_middle2 =
      sqr(dot(p.off, lamp.across) / lamp.half_across) + sqr(dot(p.off, lamp.along) / lamp.half_along);
  const auto beside = spread.is_narrow && T(3.5) < slot.kind && T(1) < from_middle2;
  return select(beside, T(0), spread.light(p.slope));
}

/// The mean of light_from() over a cone about `axis` within a lamp; chord is its radius. For cones that are no wider
/// than the light, off by 0.006 of the lamp's greatest light, root mean square, and by at most 0.04.
template <class T> T mean_light(const LampSlot<T>& slot, const LampAxes<T>& lamp, const Vec3<T>& axis, const T& chord) {
  // Six directions, a hexagon about the axis, of which two and two have the same angle to the lamp's normal. Over a
  // disk, the mean distance from the middle is 2/3 of the radius.
  constexpr double kInner = 0.675;
  const double half_root3 = std::sqrt(0.75);
  const Spread<T> spread = spread_of(slot);
  const T inner = chord * T(kInner), drop = sqr(inner) / T(2);
  const T cosine = dot(axis, lamp.away), straight = cosine - cosine * drop;
  const T aside = sqrt(T(1) - sqr(cosine)) * (inner * (sqrt(T(1) - drop / T(2)) * T(half_root3)));
  return (spread.light(straight + aside) + spread.light(straight) + spread.light(straight - aside)) / T(3);
}

/// A spot shines within a cone about its axis, at whose edge it fades: see spot_falloff().
template <class T> struct SpotCone {
  decltype(T(0) > T(0)) is_spot;
  T edge;  ///< cosine of half the cone's angle
  T fade;  ///< the difference of cosines over which the light fades

  /// The light from a direction whose cosine is given, in units of the spot's greatest; 1 for other lamps.
  T light(const T& cosine) const { return select(is_spot, smoothstep(cosine - edge), T(1)); }

  /// The mean of light() over a cone of directions. `cosine`: of the angle between its axis and the spot's. `chord`:
  /// its radius. For spots of up to 90 degrees and lamps that look up to 0.3 rad large, off by 0.004 in absolute terms,
  /// root mean square, and by at most 0.025, about the axis; for lamps up to 0.6 rad by 0.006 and 0.03.
  T mean(const T& cosine, const T& chord) const {
    constexpr double kEven = 1.6;
    // Of the brightest direction. Where less of the cone shines, errors of the mean could be larger than the mean.
    constexpr double kLeast = 1.0 / 50;
    const T chord2 = sqr(chord), middle = middle_of(cosine, chord2), bent = cosine * (chord2 / T(12));
    const T spread = spread_of(cosine, chord2);
    // Where the light fades over more than the cone: Gauss and Chebyshev's rule of the second kind, with three points.
    const T aside = spread * T(std::sqrt(0.5));
    const T beside = smoothstep(middle - bent + aside) + smoothstep(middle - bent - aside);
    const T even = smoothstep(middle + bent) / T(2) + beside / T(4);
    // Elsewhere: smoothstep is the mean of steps, with the weight 6 t (1 - t), for which this is Gauss and Jacobi's
    // rule.
    const double off = std::sqrt(0.05);
    const T steps = (part_inside(T(0.5 - off), cosine, chord2) + part_inside(T(0.5 + off), cosine, chord2)) / T(2);
    const T mean = select((spread + bent * T(6)) * T(kEven) < fade, even, steps);
    return select(is_spot, maximum(mean, smoothstep(middle + spread) * T(kLeast)), T(1));
  }

  /// 1 if any part of the cone shines on the shading point, otherwise 0; 1 for other lamps.
  T is_lit(const T& cosine, const T& chord2) const {
    const auto lit = T(0) < middle_of(cosine, chord2) + spread_of(cosine, chord2);
    return select(is_spot, select(lit, T(1), T(0)), T(1));
  }

 private:
  /// Over a cone of directions, the cosine of the angle to the spot's axis varies by `spread` to both sides of
  /// `middle`, with about the density of a semicircle.
  T middle_of(const T& cosine, const T& chord2) const { return cosine * (T(1) - chord2 / T(4)) - edge; }
  T spread_of(const T& cosine, const T& chord2) const {
    return sqrt((T(1) - sqr(cosine)) * chord2 * (T(1) - chord2 / T(4)));
  }

  T smoothstep(const T& inside) const { return spot_falloff(inside, fade); }

  /// The part of a cone of directions within the cone about the spot's axis at whose rim the light has faded to
  /// smoothstep(t): the area in which two circles in a plane overlap.
  T part_inside(const T& t, const T& cosine, const T& chord2) const {
    constexpr double kLeast = 1e-3;
    // Chords between directions at an angle get shorter by the cosine of half that angle, radially.
    const T small2 = chord2 * ((T(1) + cosine) / T(2)), large2 = T(2) * (T(1) - edge - fade * t);
    const T apart2 = maximum(T(2) * (T(1) - cosine), T(kLeast * kLeast)), apart = sqrt(apart2);
    const T small = sqrt(small2), large = sqrt(maximum(large2, T(kLeast * kLeast)));
    const auto cosine_at = [&](const T& own, const T& own2, const T& other2) {
      return maximum(minimum((apart2 + own2 - other2) / (T(2) * apart * own), T(1)), T(-1));
    };
    const auto angle = [](const T& x) { return T(2) * atan(sqrt((T(1) - x) / maximum(T(1) + x, tiny<T>()))); };
    const T at_small = cosine_at(small, small2, large2), at_large = cosine_at(large, large2, small2);
    const T triangles = apart * (small * sqrt(T(1) - sqr(at_small)));
    return (small2 * angle(at_small) + large2 * angle(at_large) - triangles) / (pi<T>() * small2);
  }
};
template <class T> SpotCone<T> spot_cone(const LampSlot<T>& slot) {
  constexpr double kLeast = 1e-4;  // Blender's spots may have no soft edge
  const T edge = cos(slot.shape.z / T(2));
  // 1 plus 0.45 times the blend: see brdfc_lamp() in osl/brdfc.osl.in.
  return {slot.kind < T(1.5) && T(0) < slot.shape.z, edge,
          maximum((slot.kind - T(1)) * T(1 / 0.45), T(kLeast)) * (T(1) - edge)};
}

}  // namespace brdfc::forms
