// SPDX-License-Identifier: GPL-3.0-or-later
// A lamp of the aimed form, as seen from a shading point: a flat patch, the part of it above a plane, and the part
// whose light cone includes the point. aimed.h says what closures carry over it. node_cones.h has the same for the form
// made of nodes.
//
// Directions and lamps are in the local frame of the shader: z is the normal on the viewer's side.
#pragma once

#include "core/vec.h"
#include "forms/spot_falloff.h"

namespace brdfc::forms {

/// v / s with one division: OSL checks the result of each, and the checks take long to compile.
template <class T> Vec3<T> divided(const Vec3<T>& v, const T& s) { return v * (T(1) / s); }
template <class T> Vec3<T> unit(const Vec3<T>& v) { return divided(v, length(v)); }

/// A lamp as a flat patch, in any unit of length: a rectangle, or a disk or ellipse, with these half axes. For a sun
/// the centre is at distance 1.
template <class T> struct LampPatch {
  Vec3<T> centre;         ///< relative to the shading point
  Vec3<T> across, along;  ///< half axes, perpendicular to each other, not 0
  T disk;                 ///< 1: disk or ellipse, 0: rectangle

  /// The point with these coordinates, each from -1 to 1. For a disk they have to lie in the unit circle.
  Vec3<T> at(const T& x, const T& y) const { return centre + across * x + along * y; }
};

/// An upper bound for the height of the lamp over the surface. If it is not above 0, an opaque surface can ignore the
/// lamp.
template <class T> T highest(const LampPatch<T>& patch) {
  return patch.centre.z + abs(patch.across.z) + abs(patch.along.z);
}

/// The height of the lamp's lowest point over the plane through the shading point with this normal.
template <class T> T lowest(const LampPatch<T>& patch, const Vec3<T>& normal) {
  const T across = dot(normal, patch.across), along = dot(normal, patch.along);
  const auto disk = patch.disk > T(0.5);
  return dot(normal, patch.centre) - select(disk, sqrt(sqr(across) + sqr(along)), abs(across) + abs(along));
}

/// The part of a lamp that lies above a plane through the shading point, parametrized by two numbers in [0, 1].
template <class T> class PartAbove {
 public:
  struct Point {
    Vec3<T> at;  ///< a point of the lamp
    T area;      ///< area element in units of the half axes; its mean over all points is the area of the part
  };

  PartAbove(const LampPatch<T>& patch, const Vec3<T>& normal) : patch_(patch), disk_(patch.disk > T(0.5)) {
    // Height over the plane: height_ + flat_ p + steep_ q, where q is the half axis that rises faster. For a disk, p is
    // parallel to the plane.
    const T a = dot(normal, patch.across), b = dot(normal, patch.along);
    const T slope = sqrt(sqr(a) + sqr(b)), unit = maximum(slope, tiny<T>());
    const auto swapped = abs(a) > abs(b);
    const Vec3<T> across = select(swapped, patch.along, patch.across),
                  along = select(swapped, patch.across, patch.along);
    p_ = select(disk_, divided(patch.across * b - patch.along * a, unit), across * sign_of(dot(normal, across)));
    q_ = select(disk_, divided(patch.across * a + patch.along * b, unit), along * sign_of(dot(normal, along)));
    height_ = dot(normal, patch.centre);
    flat_ = select(disk_, T(0), minimum(abs(a), abs(b)));
    steep_ = maximum(select(disk_, slope, maximum(abs(a), abs(b))), tiny<T>());
    const T start = minimum(maximum(-height_ / steep_, T(-1)), T(1));
    half_chord_ = sqrt(T(1) - sqr(maximum(start, T(0))));
    first_ = minimum(maximum(-(height_ + steep_) / maximum(flat_, tiny<T>()), T(-1)), T(1));
  }

  Point at(const T& u, const T& v) const {
    // For a disk, p is the sine of an angle, which makes the integrand smooth at the round ends.
    const T angle = pi<T>() * (u - T(0.5));
    const T sine = sin(angle), cosine = sqrt(maximum(T(1) - sqr(sine), T(0)));
    const T p = select(disk_, half_chord_ * sine, first_ + u * (T(1) - first_));
    const T step = select(disk_, half_chord_ * pi<T>() * cosine, T(1) - first_);
    const T end = select(disk_, sqrt(maximum(T(1) - sqr(p), T(0))), T(1));
    const T start = minimum(maximum(-(height_ + flat_ * p) / steep_, -end), end);
    return {patch_.centre + p_ * p + q_ * (start + v * (end - start)), step * (end - start)};
  }

 private:
  static T sign_of(const T& x) { return select(x < T(0), T(-1), T(1)); }

  LampPatch<T> patch_;
  decltype(T(0) > T(0)) disk_;
  Vec3<T> p_, q_;
  T height_, flat_, steep_, half_chord_, first_;
};

/// A lamp that shines only within a cone; its brightness depends on the angle to the axis of the cone.
template <class T> struct LampBeam {
  Vec3<T> axis;  ///< unit vector against the direction of the light
  T edge;        ///< cosine of the cone's half angle, above 0
  T blend;       ///< spot: fraction of 1 - edge over which it fades; negative: an area lamp with spread

  /// Relative radiance that arrives at the shading point from direction wi. A spot fades with
  /// spot_falloff(), a spread lamp with the tangent, as in Cycles (kernel/light/area.h).
  T operator()(const Vec3<T>& wi) const {
    const T c = maximum(dot(axis, wi), tiny<T>());
    const T of_spot = spot_falloff(c - edge, maximum(blend * (T(1) - edge), T(1e-4)));
    const auto tangent = [](const T& cosine) { return sqrt(maximum(T(1) - sqr(cosine), T(0))) / cosine; };
    return select(blend < T(0), maximum(tangent(edge) - tangent(c), T(0)), of_spot);
  }
};

/// The part of a lamp with a light cone that shines on the shading point.
template <class T> struct LitPart {
  LampPatch<T>
      lamp;  ///< bounds of the part that may shine here; the rest of the lamp is treated like any other direction
  /// The rectangle or, for a disk, the ellipse that f is averaged over: it has the same centre and variances as the
  /// light. With half axes of 0 the lamp does not shine here.
  LampPatch<T> mean;
};
template <class T> LitPart<T> lit_part(const LampPatch<T>& patch, const LampBeam<T>& beam) {
  constexpr int kSteps = 5;
  const T a = length(patch.across), b = length(patch.along);
  const Vec3<T> n = divided(cross(patch.across, patch.along), a * b);
  const T slant = dot(n, beam.axis), reach = dot(n, patch.centre) / select(abs(slant) > T(0.01), slant, T(0.01));
  const Vec3<T> middle = beam.axis * reach - patch.centre;
  // The cone meets the lamp's plane within a circle about its axis. The circle is larger if the axis is oblique.
  const T sine = sqrt(maximum(T(1) - sqr(beam.edge), T(0)));
  const T tilt = sqrt(maximum(T(1) - sqr(slant), T(0)));
  const T radius = abs(reach) * sine / maximum(abs(slant) * beam.edge - tilt * sine, T(0.01));
  const auto range = [&](const T& at, const T& half) {
    const auto within = [](const T& x) { return minimum(maximum(x, T(-1)), T(1)); };
    return std::array<T, 2>{within((at - radius) / half), within((at + radius) / half)};
  };
  const std::array<T, 2> xs = range(dot(middle, patch.across) / a, a), ys = range(dot(middle, patch.along) / b, b);
  const T step_x = (xs[1] - xs[0]) / T(kSteps), step_y = (ys[1] - ys[0]) / T(kSteps);
  const T first_x = xs[0] + step_x / T(2);
  // State of the loop: x, y, and the sums of light, light x, light y, light x^2, light y^2.
  const std::array<T, 7> sums =
      iterate(kSteps * kSteps, std::array<T, 7>{first_x, ys[0] + step_y / T(2), T(0), T(0), T(0), T(0), T(0)},
              [&](const std::array<T, 7>& s) {
                const auto on = patch.disk < T(0.5) || sqr(s[0]) + sqr(s[1]) < T(1);
                const T light = select(on, beam(normalize(patch.at(s[0], s[1]))), T(0));
                const T next = s[0] + step_x;
                const auto turns = next > xs[1];
                return std::array<T, 7>{select(turns, first_x, next),
                                        select(turns, s[1] + step_y, s[1]),
                                        s[2] + light,
                                        s[3] + light * s[0],
                                        s[4] + light * s[1],
                                        s[5] + light * sqr(s[0]),
                                        s[6] + light * sqr(s[1])};
              });
  const auto lit = sums[2] > T(0);
  const T all = select(lit, sums[2], T(1)), x = sums[3] / all, y = sums[4] / all;
  // Each sample stands for a grid cell, whose own variance is a twelfth of its squared width. The squared half axis is
  // three times the variance over a rectangle, and four times that over an ellipse. A rectangle of the variances of a
  // disk would have corners outside of it, and of a lobe that is narrow for other lamps.
  const T times = select(patch.disk > T(0.5), T(4), T(3));
  const auto half = [&](const T& square, const T& mean, const T& step) {
    return select(lit, sqrt(times * (maximum(square / all - sqr(mean), T(0)) + sqr(step) / T(12))), T(0));
  };
  const T half_x = (xs[1] - xs[0]) / T(2), half_y = (ys[1] - ys[0]) / T(2);
  const auto whole = half_x + half_y >= T(2);
  return {
      {patch.at((xs[0] + xs[1]) / T(2), (ys[0] + ys[1]) / T(2)), patch.across * half_x, patch.along * half_y,
       select(whole, patch.disk, T(0))},
      {patch.at(x, y), patch.across * half(sums[5], x, step_x), patch.along * half(sums[6], y, step_y), patch.disk}};
}

}  // namespace brdfc::forms
