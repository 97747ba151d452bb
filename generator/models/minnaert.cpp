// SPDX-License-Identifier: GPL-3.0-or-later
// Minnaert's law of limb darkening.
//
// M. Minnaert: The Reciprocity Principle in Lunar Photometry, Astrophysical Journal 93, 1941. With the cosines of the
// directions to the light and to the viewer,
//   f = rho (k + 1) / (2 pi) (cos theta_i cos theta_o)^(k - 1),
// reciprocal, and so scaled that rho is the albedo seen from above. The albedo is rho (cos theta_o)^(k - 1). Lambert's
// law is k = 1. Published fits to moons and planets mostly have k from 0.5, where a ball that is lit from the viewer is
// evenly bright, as the full moon is, to 1.
//
// The rim. For k < 1 that f is unbounded at the horizon. The fits hold some degrees above it, and where interpolated
// normals turn away from the viewer, single pixels of an outline would be white. So for k < 1 the square of each cosine
// is here c^2 + (1 - c^2) cos^2 theta with c = 0.05: f is within 3 % of the law where both directions are up to 78
// degrees from the normal, the albedo seen from above is rho but for 0.9 %, and the rim is at most 0.05^(k - 1) times
// as bright as the middle.
//
// Energy. For k >= 1 no light is gained. For k < 1 the albedo exceeds 1 where cos theta_o is below rho^(1 / (1 - k)):
// with rho = 0.12 and k = 0.6, about the moon's, nowhere. A ball in even light reflects nearly 2 rho / (k + 1) of it,
// for k = 0.5 a third more than rho; and in a hollow ball each reflection has the factor rho (k + 1) / (2 k), or a
// little less: white walls with k = 0.5 multiply light by 1.43. Below k = 0.5 even a lamp near the viewer would make
// the rim brighter than the middle. Above k = 10 all but the middle of a ball is black.
//
// Sampling by a power of the cosine is exact for k >= 1: the weight depends on the view alone.
#include "model/power_lobe.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Minnaert {
  Rgb<T> rho;
  T k;

  static constexpr double kLeast = 0.05;

  static ModelInfo info() {
    return {.name = "minnaert",
            .label = "Minnaert",
            .look = Look::Matte,
            .paper = "M. Minnaert: The Reciprocity Principle in Lunar Photometry, Astrophysical Journal 93, 1941",
            .equations = "f = rho (k + 1) / (2 pi) (cos theta_i cos theta_o)^(k - 1), bounded at the horizon for k < 1",
            .doc =
                "Moons and planets by one number: below 1 the rim is brighter than that of a matte ball, above 1 "
                "darker.",
            .properties = {.conserving = false, .exact_sampling = false, .diffuse_limit = "k=1"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.8, 0.8, 0.8}, "Share of the light that is reflected, seen from above"});
    v(k, NumberSpec{"k", "Limb Darkening", 1.5, 0.5, 10, 0.5, 4,
                    "1 is Lambert's law; larger values darken the rim; the full moon has about 0.5"}
             .by_factors());
  }

  /// f at normal incidence, seen from above, over rho.
  T top() const { return (k + T(1)) / (T(2) * pi<T>()); }
  T least2() const { return select(k < T(1), T(kLeast * kLeast), T(0)); }
  /// The square of the cosine, bounded from below for k < 1.
  T bounded2(const T& cosTheta) const { return maximum(least2() + (T(1) - least2()) * sqr(cosTheta), tiny<T>()); }
  T power(const T& cos2) const { return pow(cos2, (k - T(1)) / T(2)); }
  /// The albedo over rho, but for the bound on the light's cosine.
  T seen(const Vec3<T>& wo) const { return named("seen", power(bounded2(wo.z))); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T both = named("both", bounded2(wi.z) * bounded2(wo.z));
    return select(above(wi, wo), rho * (top() * power(both)), Rgb<T>(T(0)));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), top() * pow(maximum(wi.z, tiny<T>()), k), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_power_lobe(k, u.y, u.z);
    // bounded2() over cos^2.
    const T beyond = named("beyond", T(1) - least2() + least2() / maximum(sqr(wi.z), tiny<T>()));
    return sample_if(above(wi, wo), wi, rho * (seen(wo) * power(beyond)), pdf(wi, wo));
  }

  /// f cos(theta_i) is a function of the view times one of the light's cosine: a ramp is all of it but for the curve
  /// between two colours. Where the curve is hollow, the brightest colour is lowered by what straight lines add.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    Closure<T> ramp(ClosureKind::DiffuseRamp, rho * seen(wo));
    const T scale = (k + T(1)) / T(2);
    T rest = T(double(kRampSize - 1)) / (k + T(1));
    ramp.ramp[0] = Rgb<T>(T(0));
    for (int i = 1; i < kRampSize - 1; ++i) {
      const T c(i / double(kRampSize - 1)), height = c * power(bounded2(c));
      ramp.ramp[std::size_t(i)] = Rgb<T>(scale * height);
      rest = rest - height;
    }
    ramp.ramp[kRampSize - 1] = Rgb<T>(scale * minimum(T(2) * rest, T(1)));
    return {ramp};
  }

  /// For k <= 1, cos^k is at least the cosine. Above, it is at least two cones about the normal, linear in the angle:
  /// heights[0] at the normal, heights[1] where cos^k is powers[0], and 0 where it is powers[1].
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const std::array<double, 2> heights = {0.999, 0.189}, powers = {0.199, 0.043};
    const Rgb<T> factor = rho * (top() * seen(wo));
    const auto is_matte = k <= T(1);
    ClosureSum<T> sum{Closure<T>(ClosureKind::Diffuse, factor * select(is_matte, pi<T>(), T(0)))};
    T inner(0);
    for (std::size_t i = 0; i < 2; ++i) {
      // 1 - cos theta without cancellation; and theta in units of 90 degrees. Over 2 pi drop a cone's height is 1.
      const T drop = named("drop", -expm1(T(std::log(powers[i])) / maximum(k, T(1))));
      const T outer = named("outer", T(4 * kInvPi) * atan(sqrt(drop / (T(2) - drop))));
      const double height = heights[i] - (i == 0 ? heights[1] : 0);
      Closure<T>& c =
          sum.emplace_back(ClosureKind::DiffuseToon, factor * select(is_matte, T(0), T(2 * kPi * height) * drop));
      c.size = inner, c.smooth = outer - inner;
      inner = outer;
    }
    return sum;
  }
};

BRDFC_MODEL(Minnaert)
BRDFC_UNDER(Minnaert)

}  // namespace brdfc
