// SPDX-License-Identifier: GPL-3.0-or-later
// The aimed form: base + lamps + rest. Equal to the model in expectation, whatever the base and wherever the lamps.
//
//   base   closures that carry most of the model: those that it declares (Brdf::base), a fit (fit/fit.h), or none
//   lamps  one closure a lamp, aimed at it, whose value there is the model's own f cos less the base, so that light
//          sampling meets the model itself
//   rest   a direction that the shader draws, as a lobe as narrow as those of a sampled form, which carries what the
//          other two leave of f cos, over the density of drawing it
//
// Where a drawn direction meets a lamp, lamp and rest share f cos - base by a power heuristic (E. Veach, L. Guibas:
// Optimally Combining Sampling Techniques for Monte Carlo Rendering, 1995): a lobe wins for lamps that are small beside
// the model's lobe, the drawn direction for those that are large. Elsewhere the rest takes off what lobes give beside
// their lamps, for which some directions are drawn from there: the model's own hardly come where it falls steeply. The
// one approximation: over a lamp f and what reaches the point of its light are averaged apart. Where a cone bounds
// that, f is averaged over what shines here (lit_part()); what stands in the way is not known.
//
// Directions and lamps are in the local frame of the shader: z is the normal on the viewer's side.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "closures/closure.h"
#include "model/sampling.h"

namespace brdfc::forms {

/// A lamp as a flat patch, in units of any length: a disk or ellipse with these half axes, or a rectangle. A sun has
/// its centre at distance 1.
template <class T> struct LampPatch {
  Vec3<T> centre;         ///< from the shading point
  Vec3<T> across, along;  ///< half axes, perpendicular to each other and longer than 0
  T disk;                 ///< 1: disk or ellipse, 0: rectangle

  /// A point by two coordinates from -1 to 1, of a disk within the unit circle.
  Vec3<T> at(const T& x, const T& y) const { return centre + across * x + along * y; }
};

/// How high above the surface the lamp reaches, at most. Where that is not above 0, a surface that lets no light
/// through need not look at it.
template <class T> T highest(const LampPatch<T>& patch) {
  return patch.centre.z + abs(patch.across.z) + abs(patch.along.z);
}

/// The same of the part that reaches lowest, over a plane with this normal.
template <class T> T lowest(const LampPatch<T>& patch, const Vec3<T>& normal) {
  const T across = dot(normal, patch.across), along = dot(normal, patch.along);
  const auto disk = patch.disk > T(0.5);
  return dot(normal, patch.centre) - select(disk, sqrt(sqr(across) + sqr(along)), abs(across) + abs(along));
}

/// The part of a lamp that lies above a plane through the shading point, by two numbers in [0, 1].
template <class T> class PartAbove {
 public:
  struct Point {
    Vec3<T> at;  ///< of the lamp
    T area;      ///< what it stands for: in units of the half axes, the mean of all is the area of the part
  };

  PartAbove(const LampPatch<T>& patch, const Vec3<T>& normal) : patch_(patch), disk_(patch.disk > T(0.5)) {
    // Height over the plane: height_ + flat_ p + steep_ q, where q is the half axis that rises faster. Of a disk p runs
    // level.
    const T a = dot(normal, patch.across), b = dot(normal, patch.along);
    const T slope = sqrt(sqr(a) + sqr(b)), unit = maximum(slope, tiny<T>());
    const auto swapped = abs(a) > abs(b);
    const Vec3<T> across = select(swapped, patch.along, patch.across),
                  along = select(swapped, patch.across, patch.along);
    p_ = select(disk_, (patch.across * b - patch.along * a) / unit, across * sign_of(dot(normal, across)));
    q_ = select(disk_, (patch.across * a + patch.along * b) / unit, along * sign_of(dot(normal, along)));
    height_ = dot(normal, patch.centre);
    flat_ = select(disk_, T(0), minimum(abs(a), abs(b)));
    steep_ = maximum(select(disk_, slope, maximum(abs(a), abs(b))), tiny<T>());
    const T start = minimum(maximum(-height_ / steep_, T(-1)), T(1));
    half_chord_ = sqrt(T(1) - sqr(maximum(start, T(0))));
    first_ = minimum(maximum(-(height_ + steep_) / maximum(flat_, tiny<T>()), T(-1)), T(1));
  }

  Point at(const T& u, const T& v) const {
    // Across a disk by the sine, so that its round ends are smooth.
    const T angle = pi<T>() * (u - T(0.5));
    const T p = select(disk_, half_chord_ * sin(angle), first_ + u * (T(1) - first_));
    const T step = select(disk_, half_chord_ * pi<T>() * cos(angle), T(1) - first_);
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

/// A lamp that shines within a cone alone, as bright as the angle to its axis says.
template <class T> struct LampBeam {
  Vec3<T> axis;  ///< unit; light goes the other way
  T edge;        ///< cosine of the angle where it ends, above 0
  T blend;       ///< of a spot: the share of 1 - edge over which it fades; less than 0: the spread of an area lamp

  /// Radiance towards the shading point of what lies in this direction, up to a factor. Cycles, kernel/light/spot.h and
  /// area.h: a spot fades by smoothstep of the cosine, spread by the tangent.
  T operator()(const Vec3<T>& wi) const {
    const T c = maximum(dot(axis, wi), tiny<T>());
    const T into = clamp01((c - edge) / maximum(blend * (T(1) - edge), T(1e-4)));
    const auto tangent = [](const T& cosine) { return sqrt(maximum(T(1) - sqr(cosine), T(0))) / cosine; };
    return select(blend < T(0), maximum(tangent(edge) - tangent(c), T(0)), sqr(into) * (T(3) - T(2) * into));
  }
};

/// What a shading point sees of a lamp that may shine elsewhere.
template <class T> struct LitPart {
  LampPatch<T> lamp;  ///< all that may shine here; what else the lamp covers is as any other direction
  /// What f is averaged over: the rectangle that has the centre and the variances of the light. Half axes of 0: the
  /// lamp does not shine here.
  LampPatch<T> mean;
};
template <class T> LitPart<T> lit_part(const LampPatch<T>& patch, const LampBeam<T>& beam) {
  constexpr int kSteps = 5;
  const T a = length(patch.across), b = length(patch.along);
  const Vec3<T> n = cross(patch.across, patch.along) / (a * b);
  const T slant = dot(n, beam.axis), reach = dot(n, patch.centre) / select(abs(slant) > T(0.01), slant, T(0.01));
  const Vec3<T> middle = beam.axis * reach - patch.centre;
  // The cone meets the lamp's plane within a circle about its axis, wider where the axis is oblique.
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
  // x, y, and the sums of light, of its moments and of their squares.
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
  // Each place stands for a cell, whose own variance is a twelfth of its square.
  const auto half = [&](const T& square, const T& mean, const T& step) {
    return select(lit, sqrt(maximum(T(3) * (square / all - sqr(mean)), T(0)) + sqr(step) / T(4)), T(0));
  };
  const T half_x = (xs[1] - xs[0]) / T(2), half_y = (ys[1] - ys[0]) / T(2);
  const auto whole = half_x + half_y >= T(2);
  return {{patch.at((xs[0] + xs[1]) / T(2), (ys[0] + ys[1]) / T(2)), patch.across * half_x, patch.along * half_y,
           select(whole, patch.disk, T(0))},
          {patch.at(x, y), patch.across * half(sums[5], x, step_x), patch.along * half(sums[6], y, step_y), T(0)}};
}

/// How much of a ramp's flank, from 1 down, an aimed lobe is level over: colours of 7/k at its entries k >= kLevel make
/// colour times cos^e equal 1 (to 2 %) where cos^e >= kLevel / 7.
inline constexpr int kLevel = 3;
/// Colours of the ramp of an aimed lobe whose height is 1, from cos^e = 0 to cos^e = 1.
constexpr std::array<double, kRampSize> aimed_ramp() {
  std::array<double, kRampSize> ramp{};
  for (int k = kLevel; k < kRampSize; ++k) ramp[std::size_t(k)] = double(kRampSize - 1) / k;
  return ramp;
}

/// phong_ramp(half, exponent, height * aimed_ramp()): f cos is 1 over the lamp and falls to 0 beside it.
template <class T> struct AimedLobe {
  Vec3<T> towards;  ///< the lamp's centre
  Vec3<T> half;     ///< the closure's normal
  T exponent;
  T sinRadius;  ///< of the lamp
  T cosEnd;     ///< from its centre on the lobe is 0
  T extent;     ///< solid angle of where it is not
};

/// What a shading point makes of a lamp.
template <class T> struct AimedLamp {
  AimedLobe<T> lobe;
  Vec3<T> wi;     ///< to a point of the lamp, unit
  T emphasis;     ///< what the point stands for over the mean of all points, and over the lobe's height there, which is
                  ///< 1 to some percent; 0 where the lamp is left to the rest
  T solid_angle;  ///< of the lamp
  T height;       ///< of the closure's colours over aimed_ramp() where f cos is 1
};

/// cos^e -> f cos of an aimed lobe over its height and (half.wi): ramp times cos^e.
template <class T> T aimed_profile(const T& lobe) {
  const T position = T(kRampSize - 1) * lobe;
  // The entry below the position: its colour and the step to the next are 7/k and 7/(k (k + 1)).
  T k(kLevel);
  for (int i = kLevel + 1; i < kRampSize - 1; ++i) k = select(position < T(i), k, T(i));
  const T level = (T(kRampSize - 1) / k) * (T(1) - (position - k) / (k + T(1)));
  const T flank = (position - T(kLevel - 1)) * T(double(kRampSize - 1) / kLevel);
  return lobe * select(position < T(kLevel), maximum(flank, T(0)), level);
}

/// aimed_profile() of a lobe at this cosine from its centre.
template <class T> T profile_of(const AimedLobe<T>& lobe, const T& cosAlpha) {
  return aimed_profile(pow(maximum(cosAlpha, lobe.cosEnd), lobe.exponent));
}

/// f cos of the lobe of an aimed closure.
template <class T> T evaluate(const AimedLobe<T>& lobe, const Vec3<T>& wi) {
  const T cosAlpha = dot(lobe.towards, wi), rise = dot(lobe.half, wi);
  const T profile = profile_of(lobe, cosAlpha);
  return select(cosAlpha > lobe.cosEnd && rise > T(0), profile * (rise / dot(lobe.half, lobe.towards)), T(0));
}

/// How far a lobe towards `centre` may reach, as a sine, without covering the lamp of an earlier one: what it gave
/// there the drawn directions would have to take off again, bright as the lamp is.
template <class T> T room_beside(const Vec3<T>& centre, const AimedLobe<T>& earlier) {
  return length(normalize(centre) - earlier.towards) - earlier.sinRadius;
}

/// A closure aimed at a lamp whose bounding sphere has the radius of this sine. wo: towards the viewer, unit.
template <class T> AimedLobe<T> aim(const Vec3<T>& towards, const T& sinRadius, const T& room, const Vec3<T>& wo) {
  // Room for the drawn directions' own lobes, 5e-3 wide; and cos^e of a narrower lobe loses digits in single precision.
  constexpr double kRoom = 1.1, kLeast = 0.03, kTight = 0.005, kMost = 0.95;
  // The flank ends where cos^e = (kLevel - 1) / 7; sines of small angles are as the roots of the logarithms.
  const double level = std::log(double(kLevel) / (kRampSize - 1)), end = std::log(double(kLevel - 1) / (kRampSize - 1));
  const T wide = minimum(T(kRoom) * sinRadius + T(kLeast), T(std::sqrt(level / end)) * room);
  const T sinWidth = minimum(maximum(wide, sinRadius + T(kTight)), T(kMost));
  AimedLobe<T> lobe;
  lobe.towards = towards;
  lobe.half = normalize(towards + wo);
  // cos^e = kLevel / 7 at the width
  lobe.exponent = T(2 * level) / log1p(-sqr(sinWidth));
  lobe.sinRadius = sinRadius;
  lobe.cosEnd = exp(T(end) / lobe.exponent);
  lobe.extent = T(-2) * pi<T>() * expm1(T(end) / lobe.exponent);
  return lobe;
}

/// A direction under a lobe, each as likely as the others; and how likely that is.
template <class T> Vec3<T> sample_under(const AimedLobe<T>& lobe, const T& u, const T& v) {
  // From 1 - cos, which has all its digits.
  const T drop = u * lobe.extent / (T(2) * pi<T>()), sine = sqrt(drop * (T(2) - drop)), turn = T(2) * pi<T>() * v;
  const auto upright = abs(lobe.towards.z) > T(0.9);
  const Vec3<T> t =
      normalize(cross(lobe.towards, Vec3<T>{select(upright, T(1), T(0)), T(0), select(upright, T(0), T(1))}));
  const Vec3<T> b = cross(lobe.towards, t);
  return lobe.towards * (T(1) - drop) + t * (sine * cos(turn)) + b * (sine * sin(turn));
}
template <class T> T pdf_under(const AimedLobe<T>& lobe, const Vec3<T>& wi) {
  return select(dot(lobe.towards, wi) > lobe.cosEnd, T(1) / lobe.extent, T(0));
}

/// What a direction that was drawn is to a lamp.
template <class T> struct Against {
  T meets;        ///< 1 on the lamp, else 0
  T in_seam;      ///< 1 near its edge, on either side
  Vec3<T> moved;  ///< in the seam the direction at its border, on the same side, else the direction itself
};

/// The rest is drawn as a lobe 1e-3 wide, which in a seam about the edge of a lamp lies partly on the lamp and partly
/// beside it. What reaches over of a direction beside the lamp light sampling would find rarely, and make of what
/// little is left there a dot as bright as the lamp, or as dark; what reaches over of a direction on the lamp would be
/// lost. At the seam's border, outside or inside, the lobe meets next to the same light without that.
template <class T> Against<T> against(const LampPatch<T>& patch, const Vec3<T>& drawn) {
  constexpr double kSeam = 5e-3;
  const auto disk = patch.disk > T(0.5);
  const Vec3<T> normal = cross(patch.across, patch.along);
  const T facing = dot(normal, drawn), slant = select(abs(facing) > tiny<T>(), facing, tiny<T>());
  const T reach = dot(normal, patch.centre) / slant;
  const Vec3<T> offset = drawn * reach - patch.centre;
  const T a2 = dot(patch.across, patch.across), b2 = dot(patch.along, patch.along);
  const T x = dot(offset, patch.across) / a2, y = dot(offset, patch.along) / b2;
  const T radius = select(disk, sqrt(x * x + y * y), maximum(abs(x), abs(y)));
  const auto on = reach > T(0) && radius < T(1);
  // The seam's width in the plane of the lamp, and where it ends, in units of the half axes.
  const T width = T(kSeam) * reach * sqrt(a2 * b2) / maximum(abs(facing), tiny<T>()) * select(on, T(-1), T(1));
  const T end_x = maximum(T(1) + width / sqrt(a2), T(0)), end_y = maximum(T(1) + width / sqrt(b2), T(0));
  const T round = select(on, minimum(end_x, end_y), maximum(end_x, end_y)) / maximum(radius, tiny<T>());
  const auto off_x = abs(x) > select(on, end_x, T(1)), off_y = (on && abs(y) > end_y) || (!on && !off_x);
  const auto beyond =
      select(disk, round, minimum(end_x / maximum(abs(x), tiny<T>()), end_y / maximum(abs(y), tiny<T>()))) < T(1);
  const auto near = (on && beyond) || (!on && reach > T(0) && !beyond);
  const Vec3<T> moved = normalize(patch.at(select(disk, x * round, select(off_x, select(x > T(0), end_x, -end_x), x)),
                                           select(disk, y * round, select(off_y, select(y > T(0), end_y, -end_y), y))));
  const auto moves = near && moved.z * drawn.z > T(0);
  return {select(on, T(1), T(0)), select(moves, T(1), T(0)), select(moves, moved, drawn)};
}

/// `shining`: the mean of its lit_part(), or the lamp. `room`: see room_beside(). v1, v2: numbers in [0, 1) that choose
/// a point of it.
template <class T> AimedLamp<T> aim_at(const LampPatch<T>& patch, const LampPatch<T>& shining, const T& room,
                                       const T& v1, const T& v2, const Vec3<T>& wo) {
  /// Sine of the radius beyond which a lamp is so near that drawn directions meet it well.
  constexpr double kNearest = 0.85;
  /// Cosine between the closure's normal and any point of the lamp below which the normal is but rounding; and the same
  /// in units of that to the lamp's centre, where the closure would be as good as black.
  constexpr double kLeastRise = 0.005, kLeastShare = 0.2;
  const auto disk = patch.disk > T(0.5);
  const T a2 = dot(patch.across, patch.across), b2 = dot(patch.along, patch.along);
  const T distance2 = dot(patch.centre, patch.centre);
  const T radius2 = select(disk, maximum(a2, b2), a2 + b2);
  AimedLamp<T> lamp;
  const Vec3<T> towards = patch.centre / sqrt(distance2);
  lamp.lobe = aim(towards, sqrt(minimum(radius2 / distance2, T(1))), room, wo);
  const T rise = dot(lamp.lobe.half, towards);
  lamp.height = T(2) * pi<T>() / (rise * (lamp.lobe.exponent + T(2)));

  const T radius = sqrt(v1), angle = T(2) * pi<T>() * v2;
  const auto round = shining.disk > T(0.5);
  const Vec3<T> point = shining.at(select(round, radius * cos(angle), T(2) * v1 - T(1)),
                                   select(round, radius * sin(angle), T(2) * v2 - T(1)));
  lamp.wi = normalize(point);
  // Solid angle over area, up to the length of `normal`, which is the area up to 4 or pi.
  const Vec3<T> normal = cross(patch.across, patch.along);
  const auto density = [&](const Vec3<T>& p) {
    const T d2 = dot(p, p);
    return abs(dot(normal, p)) / (d2 * sqrt(d2));
  };
  // Its mean over what shines by four points, which is right to third degree (A. Stroud: Approximate Calculation of
  // Multiple Integrals, 1971, C2: 3-1 and S2: 3-1); and by the same, how high above the lobe's normal that is.
  const T node = select(round, T(std::sqrt(0.5)), T(std::sqrt(1.0 / 3))), other = select(round, T(0), node);
  T mean(0), mean_rise(0);
  for (const Vec3<T>& p : {shining.at(node, other), shining.at(-node, other * T(-1)), shining.at(other * T(-1), node),
                           shining.at(other, -node)}) {
    const T d = density(p);
    mean = mean + d / T(4);
    mean_rise = mean_rise + d / T(4) * (dot(lamp.lobe.half, p) / sqrt(dot(p, p)));
  }
  lamp.solid_angle = select(disk, pi<T>(), T(4)) * mean;
  const T sinRadius = lamp.lobe.sinRadius;
  const T least_rise = rise * sqrt(T(1) - sqr(sinRadius)) - sqrt(maximum(T(1) - sqr(rise), T(0))) * sinRadius;
  const auto usable = radius2 < T(kNearest * kNearest) * distance2 && dot(shining.across, shining.across) > T(0) &&
                      least_rise > maximum(T(kLeastRise), T(kLeastShare) * rise);
  // Over the lobe's height: its profile at the point, which is even about the lamp's centre, but its slope over the
  // whole lamp. Where f slopes, too, the quotient of both at one point, times the slope where light sampling meets the
  // lamp, is not f on average.
  const T profile = profile_of(lamp.lobe, dot(towards, lamp.wi));
  lamp.emphasis = select(usable, density(point) * rise / maximum(profile * mean_rise, tiny<T>()), T(0));
  return lamp;
}

/// A lamp whose light from below a plane the closure does not meet: what it carries is the mean over the part above.
/// From 5.0 on Cycles takes closures with a normal of their own for black below the smooth normal (docs/cycles.md). v1,
/// v2: as of aim_at().
template <class T>
AimedLamp<T> cut_off(AimedLamp<T> lamp, const LampPatch<T>& shining, const Vec3<T>& normal, const T& v1, const T& v2) {
  constexpr int kSteps = 6;
  const PartAbove<T> part(shining, normal);
  const Vec3<T> axis = cross(shining.across, shining.along);
  // Solid angle of what a point stands for, up to the length of the axis.
  const auto density = [&](const typename PartAbove<T>::Point& p) {
    const T d2 = dot(p.at, p.at);
    return p.area * abs(dot(axis, p.at)) / (d2 * sqrt(d2));
  };
  // Light times the lobe's slope, over the part: the midpoint rule along u, Gauss' of two points along v.
  const std::array<T, 2> sums =
      iterate(kSteps, std::array<T, 2>{T(0.5 / kSteps), T(0)}, [&](const std::array<T, 2>& s) {
        T sum = s[1];
        for (const double v : {0.5 - std::sqrt(1.0 / 12), 0.5 + std::sqrt(1.0 / 12)}) {
          const auto p = part.at(s[0], T(v));
          sum = sum + density(p) * (dot(lamp.lobe.half, p.at) / sqrt(dot(p.at, p.at)));
        }
        return std::array<T, 2>{s[0] + T(1.0 / kSteps), sum};
      });
  const T mean_rise = sums[1] / T(2 * kSteps);
  const auto point = part.at(v1, v2);
  lamp.wi = normalize(point.at);
  const T rise = dot(lamp.lobe.half, lamp.lobe.towards);
  const T profile = profile_of(lamp.lobe, dot(lamp.lobe.towards, lamp.wi));
  // A lobe whose normal is below the plane is black above it.
  const auto shows = lamp.emphasis > T(0) && mean_rise > T(0) && dot(lamp.lobe.half, normal) > T(0);
  lamp.emphasis = select(shows, density(point) * rise / maximum(profile * mean_rise, tiny<T>()), T(0));
  return lamp;
}

/// What the drawn direction carries of a lamp of this solid angle, which it meets with this density: the power
/// heuristic, to the fourth so that it has next to nothing where the lamp is the smaller one: light sampling finds
/// that, too, and rarely.
template <class T> T share_of_drawn(const T& solid_angle, const T& density) {
  constexpr double kAll = 1e3;  // beyond it the share is 1 in single precision
  const T power = sqr(sqr(minimum(solid_angle * density, T(kAll))));
  return power / (T(1) + power);
}

/// The largest magnitude of a channel.
template <class T> T largest(const Rgb<T>& c) { return maximum(max_component(c), max_component(c * T(-1))); }

/// What a lamp's lobe carries.
template <class T> struct Sent {
  Rgb<T> value;   ///< f cos over the lamp
  T weight;       ///< of the closure: what Cycles follows it by
  Rgb<T> colour;  ///< aimed_ramp() times this are the closure's colours
};

/// `value`: f cos - base towards AimedLamp::wi, less what the lobes of earlier lamps give there; `density` that of
/// drawing it.
template <class T> Sent<T> send(const AimedLamp<T>& lamp, const Rgb<T>& value, const T& density) {
  // Cycles drops closures of small weight.
  constexpr double kLeastWeight = 1e-3;
  Sent<T> out;
  out.value = value * (lamp.emphasis * (T(1) - share_of_drawn(lamp.solid_angle, density)));
  const T size = largest(out.value);
  out.weight = select(size > T(0), minimum(maximum(size * lamp.lobe.extent, T(kLeastWeight)), T(1)), T(0));
  out.colour = out.value * (lamp.height / maximum(out.weight, T(kLeastWeight)));
  return out;
}

/// How often, where there are lobes, the drawn direction comes from under one of them.
inline constexpr double kFromLobes = 0.1;

/// u.x from 0 to 1 chooses where the drawn direction comes from, and serves again, stretched.
template <class T> struct Toss {
  T lobe;  ///< number of the lobe, less than 0: none
  T u;     ///< the number in [0, 1) for draw()
};
/// `lobes`: how many there are.
template <class T> Toss<T> toss(const T& u, const T& lobes) {
  const T of_lobes = select(lobes > T(0), T(kFromLobes), T(0));
  const auto from_lobe = u < of_lobes;
  return {select(from_lobe, minimum(u * lobes / T(kFromLobes), lobes - T(0.5)), T(-1)),
          minimum(maximum(u - of_lobes, T(0)) / (T(1) - of_lobes), T(1 - 1e-7))};
}

/// What lamps make of the drawn direction, added up lobe by lobe.
template <class T> struct Met {
  Rgb<T> covered = Rgb<T>(T(0));  ///< f cos of the lobes, but for that of the lamp that it meets
  Rgb<T> before = Rgb<T>(T(0));   ///< the same of the lobes before that one's; none where it meets no lamp
  T solid_angle{0};               ///< of the lamp that it meets, else 0
  T density{0};                   ///< sum of pdf_under()
  Vec3<T> ray;                    ///< where the rest goes: the drawn direction, or beside it; see against()
};
template <class T> Met<T> meet(Met<T> met, const LampPatch<T>& patch, const AimedLobe<T>& lobe, const T& solid_angle,
                               const Rgb<T>& value, const Vec3<T>& drawn) {
  const Against<T> lamp = against(patch, drawn);
  const auto here = lamp.meets > T(0);
  met.ray = select(here || (lamp.in_seam > T(0) && met.solid_angle <= T(0)), lamp.moved, met.ray);
  met.solid_angle = select(here, solid_angle, met.solid_angle);
  met.before = select(here, met.covered, met.before);
  // On the lamp the lobe is not quite level. Its height is in the emphasis: were it in the rest, light sampling would
  // find it there, as rarely and as bright as in a seam. Below the surface nothing is taken off.
  met.covered += value * select(here || drawn.z <= T(0), T(0), evaluate(lobe, drawn));
  met.density = met.density + pdf_under(lobe, drawn);
  return met;
}

/// Of the drawn direction, by that of draw(); `lobes`: how many there are.
template <class T> T density_of_drawn(const T& density, const T& lobes, const Met<T>& met) {
  const T of_lobes = select(lobes > T(0), T(kFromLobes), T(0));
  return (T(1) - of_lobes) * density + of_lobes * met.density / maximum(lobes, T(1));
}

/// The drawn direction's weight without its sign, and sign and colour.
template <class T> struct Rest {
  T weight;
  Rgb<T> colour;
};

/// `value`: f cos - base in the drawn direction; `density`, `lobes`: see density_of_drawn().
template <class T> Rest<T> rest(const Rgb<T>& value, const T& density, const T& lobes, const Met<T>& met) {
  const T p = density_of_drawn(density, lobes, met);
  const auto drawn = p > T(0);
  const Rgb<T> left = value - met.before;
  const Rgb<T> lacking = select(met.solid_angle > T(0), Rgb<T>(T(0)), left) - (met.covered - met.before);
  const Rgb<T> all = left * share_of_drawn(met.solid_angle, density) + lacking;
  Rest<T> out;
  const T size = largest(all);
  out.weight = select(drawn, size / select(drawn, p, T(1)), T(0));
  out.colour = all / maximum(size, tiny<T>());
  return out;
}

/// f cos - base, with the density of the direction in draw().
template <class T> struct Excess {
  Rgb<T> value;
  T density;
};

/// How often the direction of draw() comes from everywhere: a base may give light that the model has none of. Never
/// where the base has no weight.
template <class T> T share_from_everywhere(const ClosureSum<T>& base) {
  constexpr double kFromEverywhere = 0.2;
  T all(0);
  for (const Closure<T>& c : base) all = all + max_component(c.weight);
  return select(all > T(0), T(kFromEverywhere), T(0));
}

/// u: three numbers in [0, 1).
template <class T> Vec3<T> draw(const Brdf<T>& brdf, const ClosureSum<T>& base, const Vec3<T>& wo, const Vec3<T>& u) {
  if (base.empty()) return brdf.sample(wo, u).wi;
  const T share = T(1) - share_from_everywhere(base);
  // The number that chooses serves again, stretched.
  const Sample<T> s = brdf.sample(wo, {minimum(u.x / share, T(1 - 1e-7)), u.y, u.z});
  return select(u.x < share, s.wi, sample_everywhere(u.y, u.z));
}

template <class T>
Excess<T> excess(const Brdf<T>& brdf, const ClosureSum<T>& base, const Vec3<T>& wi, const Vec3<T>& wo) {
  Excess<T> out;
  out.value = brdf.eval(wi, wo) * abs(wi.z);
  out.density = brdf.pdf(wi, wo);
  if (base.empty()) return out;
  out.value = out.value - evaluate(base, wi, wo);
  const T everywhere = share_from_everywhere(base);
  out.density = (T(1) - everywhere) * out.density + everywhere * everywhere_pdf(wi);
  return out;
}

/// Cycles chooses what to follow by closures' weights. Beside a base, the rest is followed so many times as often as by
/// its light, and brings so much less each time: it alone sees the sky by chance, the base is helped by light sampling.
/// Twice cost next to nothing under lamps and smooth skies, and halved to quartered the noise of environment images;
/// four times won little more there, and cost up to two thirds more noise under lamps.
inline constexpr double kRestFollowed = 2;

/// All that one sample hands to the renderer beside the base.
struct AimedSum {
  std::vector<AimedLobe<double>> lobes;
  std::vector<Rgb<double>> values;  ///< of the lobes: f cos is value times evaluate(lobe, wi)
  Vec3<double> drawn;               ///< the drawn direction
  Vec3<double> wi;                  ///< the same, beside lamps' seams: where the rest goes
  Rgb<double> rest;                 ///< its weight
  double density;                   ///< of drawing it
};

/// As the shader goes about it (aimed.cpp), with the base for wo. u: three numbers that draw the direction; v:
/// two a lamp that choose a point of it, independent of one another. `beams`: none, or one a lamp, whose edge is 0
/// where it shines everywhere. `horizon`: the normal below which lobes are cut_off(), if they are.
AimedSum aimed_sum(const Brdf<double>&, const ClosureSum<double>& base, const std::vector<LampPatch<double>>&,
                   const Vec3<double>& wo, const Vec3<double>& u, const std::vector<std::array<double, 2>>& v,
                   const std::vector<LampBeam<double>>& beams = {}, const std::optional<Vec3<double>>& horizon = {});

}  // namespace brdfc::forms
