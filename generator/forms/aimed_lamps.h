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

/// x / y for y > 0, otherwise 0.
template <class T> T divided_or_zero(const T& x, const T& y) {
  return select(y > T(0), x / maximum(y, tiny<T>()), T(0));
}

/// Bounds of the part of a lamp with a light cone that may shine on the shading point. The rest of the lamp is treated
/// like any other direction.
template <class T> LampPatch<T> lit_bounds(const LampPatch<T>& whole, const LampBeam<T>& beam) {
  const T a = length(whole.across), b = length(whole.along);
  const Vec3<T> n = divided(cross(whole.across, whole.along), a * b);
  const T slant = dot(n, beam.axis), reach = dot(n, whole.centre) / select(abs(slant) > T(0.01), slant, T(0.01));
  const Vec3<T> middle = beam.axis * reach - whole.centre;
  // The cone meets the lamp's plane within a circle about its axis. The circle is larger if the axis is oblique.
  const T sine = sqrt(maximum(T(1) - sqr(beam.edge), T(0)));
  const T tilt = sqrt(maximum(T(1) - sqr(slant), T(0)));
  const T radius = abs(reach) * sine / maximum(abs(slant) * beam.edge - tilt * sine, T(0.01));
  struct Range {
    T middle, half;
  };
  const auto range = [&](const T& at, const T& half) {
    const auto within = [](const T& x) { return minimum(maximum(x, T(-1)), T(1)); };
    const T low = within((at - radius) / half), high = within((at + radius) / half);
    return Range{(low + high) / T(2), (high - low) / T(2)};
  };
  const Range x = range(dot(middle, whole.across) / a, a), y = range(dot(middle, whole.along) / b, b);
  const auto is_whole = x.half + y.half >= T(2);
  return {whole.at(x.middle, y.middle), whole.across * x.half, whole.along * y.half,
          select(is_whole, whole.disk, T(0))};
}

/// A point of a lamp with a light cone.
template <class T> struct LitPoint {
  Vec3<T> wi;  ///< unit vector to it
  T rise;      ///< mean cosine between the light and `half`; 0 if the lamp does not shine here
};
/// Chooses a point in proportion to the light that arrives from there, by resampling: J. Talbot, D. Cline, P. Egbert:
/// Importance Resampling for Global Illumination, Eurographics Symposium on Rendering 2005. The candidates are a grid
/// over the bounds with a random offset. `cut`: above 0.5 if nothing counts that is below the plane of `horizon`. v1,
/// v2, v3: numbers in [0, 1).
template <class T> LitPoint<T> lit_point(const LampPatch<T>& bounds, const LampPatch<T>& whole, const LampBeam<T>& beam,
                                         const Vec3<T>& half, const Vec3<T>& horizon, const T& cut, const T& v1,
                                         const T& v2, const T& v3) {
  constexpr int kSteps = 6;
  const Vec3<T> normal = cross(bounds.across, bounds.along);
  const T a2 = dot(whole.across, whole.across), b2 = dot(whole.along, whole.along), step = T(2.0 / kSteps);
  const T first = v1 * step - T(1);
  // State of the loop: the place in the bounds, the sum of the weights, that of weights times cosines, what is left of
  // the number that chooses, and the chosen direction.
  const std::array<T, 8> chosen =
      iterate(kSteps * kSteps, std::array<T, 8>{first, v2 * step - T(1), T(0), T(0), v3, T(0), T(0), T(0)},
              [&](const std::array<T, 8>& s) {
                const Vec3<T> at = bounds.at(s[0], s[1]), beside = at - whole.centre;
                const T nearness = T(1) / length(at);
                const Vec3<T> wi = at * nearness;
                const auto on = whole.disk < T(0.5) ||
                                sqr(dot(beside, whole.across) / a2) + sqr(dot(beside, whole.along) / b2) < T(1);
                const auto counts = on && (cut < T(0.5) || dot(wi, horizon) > T(0));
                const T solid_angle = abs(dot(normal, wi)) * sqr(nearness);
                const T weight = select(counts, beam(wi) * solid_angle, T(0)), sum = s[2] + weight;
                const T number = s[4] * sum;
                const auto takes = number < weight;
                const T left = divided_or_zero(select(takes, number, number - weight), select(takes, weight, s[2]));
                const T next = s[0] + step;
                const auto turns = next > first + T(2 - 1.0 / kSteps);
                return std::array<T, 8>{
                    select(turns, first, next),    select(turns, s[1] + step, s[1]),  sum,
                    s[3] + weight * dot(half, wi), select(weight > T(0), left, s[4]), select(takes, wi.x, s[5]),
                    select(takes, wi.y, s[6]),     select(takes, wi.z, s[7])};
              });
  return {{chosen[5], chosen[6], chosen[7]}, divided_or_zero(chosen[3], chosen[2])};
}

}  // namespace brdfc::forms
