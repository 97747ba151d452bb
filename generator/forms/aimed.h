// SPDX-License-Identifier: GPL-3.0-or-later
// The aimed form: f cos = base + lamps + rest. Its expected value equals the model for any base and any set of lamps.
//
//   base   closures that carry most of the model: those that it declares (Brdf::base), a fit (fit/fit.h), or none
//   lamps  one closure per lamp, aimed at it. Over the lamp its value is the model's f cos - base, so that light
//          sampling meets the model itself
//   rest   a random direction that the shader draws, emitted as a narrow lobe as in a sampled form. It carries what
//          base and lamps leave of f cos, divided by the pdf of the direction
//
// If a drawn direction hits a lamp, the lamp's closure and the rest share f cos - base by the power heuristic (E.
// Veach, L. Guibas: Optimally Combining Sampling Techniques for Monte Carlo Rendering, 1995). The closure gets most of
// it for lamps that are small compared with the model's lobe, the drawn direction for large ones. An aimed lobe is
// wider than its lamp; the rest subtracts what it gives beside the lamp. Some directions are drawn from the aimed lobes
// for that purpose, because the model's own samples are rare where the model falls off steeply. There is one
// approximation: f and the light that arrives from a lamp are averaged separately over the lamp. For a lamp with a
// light cone, f is averaged in proportion to the light that arrives here (lit_point()); occlusion is not taken into
// account.
//
// Directions and lamps are in the local frame of the shader: z is the normal on the viewer's side.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "closures/closure.h"
#include "forms/aimed_lamps.h"
#include "model/sampling.h"

namespace brdfc::forms {

/// An aimed lobe is flat where cos^e >= kLevel / 7: colours of 7/k at the ramp's entries k >= kLevel make colour times
/// cos^e equal 1 (to 2 %).
inline constexpr int kLevel = 3;
/// Colours of the ramp of an aimed lobe with height 1, from cos^e = 0 to cos^e = 1.
constexpr std::array<double, kRampSize> aimed_ramp() {
  std::array<double, kRampSize> ramp{};
  for (int k = kLevel; k < kRampSize; ++k) ramp[std::size_t(k)] = double(kRampSize - 1) / k;
  return ramp;
}

/// The closure phong_ramp(half, exponent, height * aimed_ramp()): f cos is 1 over the lamp and falls to 0 beside it.
template <class T> struct AimedLobe {
  Vec3<T> towards;  ///< towards the lamp's centre
  Vec3<T> half;     ///< the closure's normal
  T exponent;
  T sinRadius;  ///< of the lamp's bounding sphere
  T cosEnd;     ///< the lobe is 0 where the cosine to `towards` is smaller
  T extent;     ///< solid angle in which the lobe is not 0
  T rise;       ///< cosine between `half` and `towards`
};

/// What the shader computes for one lamp at a shading point.
template <class T> struct AimedLamp {
  AimedLobe<T> lobe;
  Vec3<T> wi;     ///< unit vector to the chosen point of the lamp
  T density;      ///< solid angle per area there, up to a factor
  T mean_rise;    ///< the mean of density times cosine to the lobe's normal; 0 if the lamp is left to the rest
  T solid_angle;  ///< of the whole lamp
  T height;       ///< factor from aimed_ramp() to the closure's colours for f cos = 1
};

/// The profile of an aimed lobe as a function of cos^e: ramp times cos^e. f cos is this times (half.wi) and a constant.
template <class T> T aimed_profile(const T& lobe) {
  const T position = T(kRampSize - 1) * lobe;
  // k: the ramp's entry below the position. Its colour is 7/k, the difference to the next entry 7/(k (k + 1)).
  T k(kLevel);
  for (int i = kLevel + 1; i < kRampSize - 1; ++i) k = select(position < T(i), k, T(i));
  const T level = (T(kRampSize - 1) / k) * (T(1) - (position - k) / (k + T(1)));
  const T flank = (position - T(kLevel - 1)) * T(double(kRampSize - 1) / kLevel);
  return lobe * select(position < T(kLevel), maximum(flank, T(0)), level);
}

/// aimed_profile() for a direction with this cosine to the lobe's centre. The cosine is above 0, so no pow() is needed,
/// which takes OSL's compiler longer.
template <class T> T profile_of(const AimedLobe<T>& lobe, const T& cosAlpha) {
  return aimed_profile(exp(lobe.exponent * log(maximum(cosAlpha, lobe.cosEnd))));
}

/// f cos of an aimed closure with value 1.
template <class T> T evaluate(const AimedLobe<T>& lobe, const Vec3<T>& wi) {
  const T cosAlpha = dot(lobe.towards, wi), rise = dot(lobe.half, wi);
  const T profile = profile_of(lobe, cosAlpha);
  return select(cosAlpha > lobe.cosEnd && rise > T(0), profile * (rise / lobe.rise), T(0));
}

/// The radius, as a sine, that a lobe towards `centre` may have without covering the lamp of an earlier lobe. If it
/// covered that lamp, the drawn directions would have to subtract the overlap, which is as bright as the lamp.
template <class T> T room_beside(const Vec3<T>& centre, const AimedLobe<T>& earlier) {
  return length(unit(centre) - earlier.towards) - earlier.sinRadius;
}

/// The lobe for a lamp whose bounding sphere has this sine of its angular radius. wo: unit vector to the viewer.
template <class T> AimedLobe<T> aim(const Vec3<T>& towards, const T& sinRadius, const T& room, const Vec3<T>& wo) {
  // The margins leave room for the lobes of drawn directions, 5e-3 wide. For a narrower lobe cos^e loses digits in
  // single precision.
  constexpr double kRoom = 1.1, kLeast = 0.03, kTight = 0.005, kMost = 0.95;
  // The flank ends where cos^e = (kLevel - 1) / 7. For small angles sines are proportional to the roots of the
  // logarithms.
  const double level = std::log(double(kLevel) / (kRampSize - 1)), end = std::log(double(kLevel - 1) / (kRampSize - 1));
  const T wide = minimum(T(kRoom) * sinRadius + T(kLeast), T(std::sqrt(level / end)) * room);
  const T sinWidth = minimum(maximum(wide, sinRadius + T(kTight)), T(kMost));
  AimedLobe<T> lobe;
  lobe.towards = towards;
  lobe.half = unit(towards + wo);
  // cos^e = kLevel / 7 at the width
  const T log_cos2 = log1p(-sqr(sinWidth)), drop = expm1(T(end / (2 * level)) * log_cos2);
  lobe.exponent = T(2 * level) / log_cos2;
  lobe.sinRadius = sinRadius;
  lobe.cosEnd = T(1) + drop;
  lobe.extent = T(-2) * pi<T>() * drop;
  lobe.rise = dot(lobe.half, towards);
  return lobe;
}

/// Samples the directions of a lobe uniformly; pdf_under() is the pdf.
template <class T> Vec3<T> sample_under(const AimedLobe<T>& lobe, const T& u, const T& v) {
  // Computed from 1 - cos, which keeps all digits for narrow lobes.
  const T drop = u * lobe.extent / (T(2) * pi<T>()), sine = sqrt(drop * (T(2) - drop)), turn = T(2) * pi<T>() * v;
  const auto upright = abs(lobe.towards.z) > T(0.9);
  const Vec3<T> side = cross(lobe.towards, Vec3<T>{select(upright, T(1), T(0)), T(0), select(upright, T(0), T(1))});
  const Vec3<T> t = unit(side);
  const Vec3<T> b = cross(lobe.towards, t);
  return lobe.towards * (T(1) - drop) + t * (sine * cos(turn)) + b * (sine * sin(turn));
}
template <class T> T pdf_under(const AimedLobe<T>& lobe, const Vec3<T>& wi) {
  return select(dot(lobe.towards, wi) > lobe.cosEnd, T(1) / lobe.extent, T(0));
}

/// How a drawn direction lies relative to a lamp.
template <class T> struct Against {
  T meets;        ///< 1 if the direction hits the lamp, otherwise 0
  T in_seam;      ///< 1 if it passes near the lamp's edge, inside or outside, otherwise 0
  Vec3<T> moved;  ///< in the seam, the direction at the seam's border on the same side; elsewhere the drawn direction
};

/// A drawn direction is emitted as a lobe 1e-3 wide. In a seam around the edge of a lamp, this lobe lies partly on the
/// lamp and partly beside it. For a direction beside the lamp, light sampling would rarely hit the overlapping part,
/// and would turn what the rest carries there into a bright or dark dot. For a direction on the lamp, the part that
/// reaches over the edge would be lost. Moving the direction to the border of the seam avoids both and changes the
/// light that it meets only slightly.
template <class T> Against<T> against(const LampPatch<T>& patch, const Vec3<T>& drawn) {
  constexpr double kSeam = 5e-3;
  const auto disk = patch.disk > T(0.5);
  const Vec3<T> normal = cross(patch.across, patch.along);
  const T facing = dot(normal, drawn), slant = select(abs(facing) > tiny<T>(), facing, tiny<T>());
  const T reach = dot(normal, patch.centre) / slant;
  const Vec3<T> offset = drawn * reach - patch.centre;
  const T a = length(patch.across), b = length(patch.along);
  const T x = dot(offset, patch.across) / sqr(a), y = dot(offset, patch.along) / sqr(b);
  const T radius = select(disk, sqrt(x * x + y * y), maximum(abs(x), abs(y)));
  const auto on = reach > T(0) && radius < T(1);
  // Where the seam ends in units of the half axes. In the plane of the lamp its width is this times a b.
  const T width = T(kSeam) * reach / maximum(abs(facing), tiny<T>()) * select(on, T(-1), T(1));
  const T end_x = maximum(T(1) + width * b, T(0)), end_y = maximum(T(1) + width * a, T(0));
  const T end = select(on, minimum(end_x, end_y), maximum(end_x, end_y)), round = end / maximum(radius, tiny<T>());
  const auto off_x = abs(x) > select(on, end_x, T(1)), off_y = (on && abs(y) > end_y) || (!on && !off_x);
  const auto beyond_x = maximum(abs(x), tiny<T>()) > end_x, beyond_y = maximum(abs(y), tiny<T>()) > end_y;
  const auto beyond = (disk && maximum(radius, tiny<T>()) > end) || (!disk && (beyond_x || beyond_y));
  const auto near = (on && beyond) || (!on && reach > T(0) && !beyond);
  const Vec3<T> to = patch.at(select(disk, x * round, select(off_x, select(x > T(0), end_x, -end_x), x)),
                              select(disk, y * round, select(off_y, select(y > T(0), end_y, -end_y), y)));
  const Vec3<T> moved = unit(to);
  const auto moves = near && moved.z * drawn.z > T(0);
  return {select(on, T(1), T(0)), select(moves, T(1), T(0)), select(moves, moved, drawn)};
}

/// Lower bound of the lobe's profile by which emphasis_of() divides. Over the lamp itself the profile is 1 to 2 %, so
/// this only guards against rounding.
inline constexpr double kLeastProfile = 0.25;

/// Solid angle that the chosen point stands for, over the mean of all points and over the lobe's height there, which is
/// 1 to a few percent; 0 if the lamp is left to the rest.
///
/// Divides by the lobe: by its profile at the point, which is even about the lamp's centre, but by the mean cosine over
/// the whole lamp. If the cosine at the point were used as well, f and the cosine of the point where light sampling
/// hits the lamp would be correlated wrongly, and the average would not be f.
template <class T> T emphasis_of(const AimedLamp<T>& lamp) {
  const T profile = maximum(profile_of(lamp.lobe, dot(lamp.lobe.towards, lamp.wi)), T(kLeastProfile));
  return select(lamp.mean_rise > T(0), lamp.density * lamp.lobe.rise / maximum(profile * lamp.mean_rise, tiny<T>()),
                T(0));
}

/// Solid angle per area at a point of a lamp, up to the length of `normal`, and the cosine between the point and an
/// axis.
template <class T> struct Seen { T density, cosine; };
template <class T> Seen<T> seen(const Vec3<T>& point, const Vec3<T>& normal, const Vec3<T>& axis) {
  const T nearness = T(1) / length(point);
  return {abs(dot(normal, point)) * (nearness * nearness * nearness), dot(axis, point) * nearness};
}

/// Aims a closure at a lamp, or at the lit_bounds() of one. `room`: see room_beside(). v1, v2: numbers in [0, 1) that
/// choose a point of it.
template <class T>
AimedLamp<T> aim_at(const LampPatch<T>& patch, const T& room, const T& v1, const T& v2, const Vec3<T>& wo) {
  /// The radius in units of the distance above which the lamp is left to the rest: drawn directions hit it often
  /// enough.
  constexpr double kNearest = 0.85;
  /// Lower bounds for the cosine between the closure's normal and any point of the lamp. Below the first, the normal is
  /// dominated by rounding; below the second, a fraction of the cosine to the lamp's centre, the closure is almost
  /// black.
  constexpr double kLeastRise = 0.005, kLeastShare = 0.2;
  const auto disk = patch.disk > T(0.5);
  const T a2 = dot(patch.across, patch.across), b2 = dot(patch.along, patch.along);
  const T distance2 = dot(patch.centre, patch.centre);
  const T radius2 = select(disk, maximum(a2, b2), a2 + b2);
  AimedLamp<T> lamp;
  const Vec3<T> towards = divided(patch.centre, sqrt(distance2));
  lamp.lobe = aim(towards, sqrt(minimum(radius2 / distance2, T(1))), room, wo);
  const T rise = lamp.lobe.rise;
  lamp.height = T(2) * pi<T>() / (rise * (lamp.lobe.exponent + T(2)));

  const T radius = sqrt(v1), angle = T(2) * pi<T>() * v2;
  const Vec3<T> point = patch.at(select(disk, radius * cos(angle), T(2) * v1 - T(1)),
                                 select(disk, radius * sin(angle), T(2) * v2 - T(1)));
  lamp.wi = unit(point);
  // Its length is the lamp's area divided by 4 or pi.
  const Vec3<T> normal = cross(patch.across, patch.along);
  // Means over the lamp by nine points, exact to degree 5: for a rectangle, three Gauss points on each axis; for a
  // disk, its centre and eight points of a circle (A. Stroud: Approximate Calculation of Multiple Integrals, 1971).
  // Over random lamps with an angular radius of 30 to 45 degrees, the light is off by 0.15 % (rectangles) and 0.19 %
  // (disks), root mean square; by four points, exact to degree 3, it was 1.5 and 2.1 %. Each of the eight outer points
  // is the one before it, turned by 45 degrees; those of a rectangle are on its sides and in its corners in turn. State
  // of the loop: the point, the factor that leads to the next one, its weight, and the two sums.
  const auto of = [&](double of_disk, double of_rectangle) { return select(disk, T(of_disk), T(of_rectangle)); };
  const T lengths = of(std::sqrt(2.0), 1.5), weights = of(3.0 / 16, 65.0 / 324);
  const T first = of(std::sqrt(2.0 / 3), std::sqrt(0.6));
  const T at_centre = of(1.0 / 4, 16.0 / 81) * abs(dot(normal, towards)) / distance2;
  const std::array<T, 6> means = iterate(
      8, std::array<T, 6>{first, T(0), of(std::sqrt(0.5), 1), of(3.0 / 32, 10.0 / 81), at_centre, at_centre * rise},
      [&](const std::array<T, 6>& s) {
        const Seen<T> at = seen(patch.at(s[0], s[1]), normal, lamp.lobe.half);
        const T part = s[3] * at.density;
        return std::array<T, 6>{(s[0] - s[1]) * s[2], (s[0] + s[1]) * s[2], lengths - s[2],
                                weights - s[3],       s[4] + part,          s[5] + part * at.cosine};
      });
  lamp.solid_angle = select(disk, pi<T>(), T(4)) * means[4];
  const T sinRadius = lamp.lobe.sinRadius;
  const T least_rise = rise * sqrt(T(1) - sqr(sinRadius)) - sqrt(maximum(T(1) - sqr(rise), T(0))) * sinRadius;
  const auto usable =
      radius2 < T(kNearest * kNearest) * distance2 && least_rise > maximum(T(kLeastRise), T(kLeastShare) * rise);
  lamp.density = seen(point, normal, lamp.lobe.half).density;
  lamp.mean_rise = select(usable, means[5], T(0));
  return lamp;
}

/// Restricts a lamp to the part above a plane; the closure gets no light from below it, and carries the mean over the
/// part above. From Blender 5.0 on, Cycles evaluates closures that have their own normal as black below the smooth
/// normal (docs/cycles.md). v1, v2: as for aim_at(). The mean is off by 0.2 % for lamps with an angular radius of up to
/// 20 degrees and by 0.6 % for wider ones, root mean square over random lamps, and by at most 3.4 %.
template <class T>
AimedLamp<T> cut_off(AimedLamp<T> lamp, const LampPatch<T>& patch, const Vec3<T>& normal, const T& v1, const T& v2) {
  constexpr int kSteps = 6;
  const PartAbove<T> part(patch, normal);
  const Vec3<T> axis = cross(patch.across, patch.along);
  // Integrates solid angle and cosine over the part: midpoint rule along u, three-point Gauss rule along v. The last
  // turn of the loop is the chosen point, so that the text has one copy of part.at(): copies take long to compile.
  // State of the loop: u, v, the sum, and a point and its density.
  const double between = std::sqrt(0.15), first = 0.5 - between;
  const std::array<T, 7> turns =
      iterate(3 * kSteps + 1, std::array<T, 7>{T(0.5 / kSteps), T(first), T(0), T(0), T(0), T(0), T(0)},
              [&](const std::array<T, 7>& s) {
                const auto chosen = s[0] > T(1), last = s[1] > T(0.6);
                const auto p = part.at(select(chosen, v1, s[0]), select(chosen, v2, s[1]));
                const Seen<T> there = seen(p.at, axis, lamp.lobe.half);
                const T d = p.area * there.density, weight = select(abs(s[1] - T(0.5)) < T(0.1), T(8), T(5));
                return std::array<T, 7>{select(last, s[0] + T(1.0 / kSteps), s[0]),
                                        select(last, T(first), s[1] + T(between)),
                                        select(chosen, s[2], s[2] + weight * d * there.cosine),
                                        p.at.x,
                                        p.at.y,
                                        p.at.z,
                                        d};
              });
  const T mean_rise = turns[2] / T(18 * kSteps);
  const Vec3<T> point{turns[3], turns[4], turns[5]};
  lamp.wi = unit(point);
  lamp.density = turns[6];
  // If the lobe's normal lies below the plane, the lobe is black everywhere above it.
  const auto shows = lamp.mean_rise > T(0) && dot(lamp.lobe.half, normal) > T(0);
  lamp.mean_rise = select(shows, mean_rise, T(0));
  return lamp;
}

/// Restricts a lamp to what shines of it: the point becomes a lit_point().
template <class T> AimedLamp<T> lit(AimedLamp<T> lamp, const LitPoint<T>& point) {
  lamp.wi = point.wi;
  lamp.density = T(1);
  lamp.mean_rise = select(lamp.mean_rise > T(0), point.rise, T(0));
  return lamp;
}

/// The fraction of a lamp's light that the drawn direction carries if it hits the lamp: the power heuristic for the
/// pdfs 1 / solid_angle and `density`. The exponent is 4, which leaves the drawn direction almost nothing of small
/// lamps: it would hit them rarely and cause fireflies, while light sampling finds them reliably.
template <class T> T share_of_drawn(const T& solid_angle, const T& density) {
  constexpr double kAll = 1e3;  // beyond it the share is 1 in single precision
  const T power = sqr(sqr(minimum(solid_angle * density, T(kAll))));
  return power / (T(1) + power);
}

/// The largest absolute value of the channels.
template <class T> T largest(const Rgb<T>& c) { return maximum(max_component(c), max_component(c * T(-1))); }

/// The closure that carries a lamp's light.
template <class T> struct Sent {
  Rgb<T> value;   ///< f cos over the lamp
  T weight;       ///< weight of the closure, by which Cycles chooses what to follow
  Rgb<T> colour;  ///< the closure's colours are aimed_ramp() times this
};

/// `value`: f cos - base towards AimedLamp::wi, minus what the lobes of earlier lamps give there. `density`: the pdf
/// with which draw() draws that direction. `emphasis`: emphasis_of() the lamp.
template <class T> Sent<T> send(const AimedLamp<T>& lamp, const T& emphasis, const Rgb<T>& value, const T& density) {
  // Cycles drops closures with a small weight.
  constexpr double kLeastWeight = 1e-3;
  Sent<T> out;
  out.value = value * (emphasis * (T(1) - share_of_drawn(lamp.solid_angle, density)));
  const T size = largest(out.value);
  out.weight = select(size > T(0), minimum(maximum(size * lamp.lobe.extent, T(kLeastWeight)), T(1)), T(0));
  out.colour = out.value * (lamp.height / maximum(out.weight, T(kLeastWeight)));
  return out;
}

/// Probability that the drawn direction is taken from one of the lobes, if there are any.
inline constexpr double kFromLobes = 0.1;

/// The choice between the model's draw() and the lobes, made with one random number, which is rescaled and reused.
template <class T> struct Toss {
  T lobe;  ///< index of the lobe to draw from; negative: none
  T u;     ///< the rescaled number in [0, 1) for draw()
};
/// `lobes`: how many lobes there are.
template <class T> Toss<T> toss(const T& u, const T& lobes) {
  const T of_lobes = select(lobes > T(0), T(kFromLobes), T(0));
  const auto from_lobe = u < of_lobes;
  return {select(from_lobe, minimum(u * lobes / T(kFromLobes), lobes - T(0.5)), T(-1)),
          minimum(maximum(u - of_lobes, T(0)) / (T(1) - of_lobes), T(1 - 1e-7))};
}

/// What the lamps mean for the drawn direction, summed over the lobes.
template <class T> struct Met {
  Rgb<T> covered = Rgb<T>(T(0));  ///< sum of f cos of all lobes except that of the lamp that the direction hits
  Rgb<T> before = Rgb<T>(T(0));   ///< the same for the lobes before that lamp's lobe; 0 if it hits no lamp
  T solid_angle{0};               ///< of the lamp that the direction hits, otherwise 0
  T density{0};                   ///< sum of pdf_under() over the lobes
  Vec3<T> ray;  ///< the direction of the emitted lobe: the drawn direction, or a direction beside it (against())
};
template <class T> Met<T> meet(Met<T> met, const LampPatch<T>& patch, const AimedLobe<T>& lobe, const T& solid_angle,
                               const Rgb<T>& value, const Vec3<T>& drawn) {
  const Against<T> lamp = against(patch, drawn);
  const auto here = lamp.meets > T(0);
  met.ray = select(here || (lamp.in_seam > T(0) && met.solid_angle <= T(0)), lamp.moved, met.ray);
  met.solid_angle = select(here, solid_angle, met.solid_angle);
  met.before = select(here, met.covered, met.before);
  // On its own lamp the lobe's small deviation from 1 is part of emphasis_of() and is not subtracted here. In the
  // rest it would cause rare bright dots, as in a seam. Below the surface nothing is subtracted.
  met.covered += value * select(here || drawn.z <= T(0), T(0), evaluate(lobe, drawn));
  met.density = met.density + pdf_under(lobe, drawn);
  return met;
}

/// Mixture pdf of the drawn direction. `density` is the pdf of draw(), `lobes` the number of lobes.
template <class T> T density_of_drawn(const T& density, const T& lobes, const Met<T>& met) {
  const T of_lobes = select(lobes > T(0), T(kFromLobes), T(0));
  return (T(1) - of_lobes) * density + of_lobes * met.density / maximum(lobes, T(1));
}

/// The rest as a closure: a weight without sign, and a colour that may be negative.
template <class T> struct Rest {
  T weight;
  Rgb<T> colour;
};

/// `value`: f cos - base in the drawn direction. `density`, `lobes`: see density_of_drawn().
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

/// f cos - base, and the pdf with which draw() draws the direction.
template <class T> struct Excess {
  Rgb<T> value;
  T density;
};

/// Probability that draw() samples the hemisphere uniformly. It is needed because a base may give light where the model
/// has none. It is 0 if the base has no weight.
template <class T> T share_from_everywhere(const ClosureSum<T>& base) {
  constexpr double kFromEverywhere = 0.2;
  T all(0);
  for (const Closure<T>& c : base) all = all + max_component(c.weight);
  return select(all > T(0), T(kFromEverywhere), T(0));
}

/// Draws a direction from the model, or from everywhere. u: three numbers in [0, 1).
template <class T> Vec3<T> draw(const Brdf<T>& brdf, const ClosureSum<T>& base, const Vec3<T>& wo, const Vec3<T>& u) {
  if (base.empty()) return brdf.sample(wo, u).wi;
  const T share = T(1) - share_from_everywhere(base);
  // The number that made the choice is rescaled and reused.
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

/// Cycles chooses the closure to follow by weight. Beside a base, the rest is followed this many times as often as its
/// light alone would ask for, and counts for correspondingly less each time. The rest sees the sky only by chance,
/// while the base is helped by light sampling. A factor of 2 cost almost nothing under lamps and smooth skies, and
/// reduced the noise of environment images to between a half and a quarter. A factor of 4 gained little more there and
/// cost up to two thirds more noise under lamps.
inline constexpr double kRestFollowed = 2;

/// Everything that one shader sample passes to the renderer besides the base.
struct AimedSum {
  std::vector<AimedLobe<double>> lobes;
  std::vector<Rgb<double>> values;  ///< of the lobes: f cos is value times evaluate(lobe, wi)
  Vec3<double> drawn;               ///< the drawn direction
  Vec3<double> wi;                  ///< the direction of the emitted lobe: `drawn`, moved off the seams of lamps
  Rgb<double> rest;                 ///< weight of the rest
  double density;                   ///< pdf of the drawn direction
};

/// The computation of the shader (aimed.cpp) in double precision, with the base for wo. u: three numbers that draw the
/// direction. v: three independent numbers per lamp that choose a point of it. `beams`: empty, or one per lamp, with
/// edge 0 if the lamp shines in all directions. `horizon`: normal of the plane below which lobes are cut_off(), if they
/// are.
AimedSum aimed_sum(const Brdf<double>&, const ClosureSum<double>& base, const std::vector<LampPatch<double>>&,
                   const Vec3<double>& wo, const Vec3<double>& u, const std::vector<std::array<double, 3>>& v,
                   const std::vector<LampBeam<double>>& beams = {}, const std::optional<Vec3<double>>& horizon = {});

}  // namespace brdfc::forms
