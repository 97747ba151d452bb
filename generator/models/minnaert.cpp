// SPDX-License-Identifier: GPL-3.0-or-later
// Minnaert's law of limb darkening.
//
// M. Minnaert: The Reciprocity Principle in Lunar Photometry, Astrophysical Journal 93, 1941. With the cosines of the
// directions to the light and to the viewer,
//   f = rho (k + 1) / (2 pi) (cos theta_i cos theta_o)^(k - 1),
// reciprocal, and so scaled that rho is the albedo seen from above. The albedo is rho (cos theta_o)^(k - 1).
//
// Energy. For k >= 1 no light is gained. Published fits to moons and planets mostly have k from 0.5, where a ball that
// is lit from the viewer is evenly bright, as the full moon is, to 1; Lambert's law is k = 1. For k < 1 the albedo is
// unbounded at the rim, and above 1 where cos theta_o is below rho^(1 / (1 - k)): with the moon's rho = 0.12 and k =
// 0.6, within 0.3 degrees of the horizon. A ball in even light is finite nevertheless, and so is the variance of its
// pixels: it reflects 2 rho / (k + 1) of all light, for k = 0.5 a third more than rho. In a hollow ball each reflection
// has the factor rho (k + 1) / (2 k), so that white walls with k = 0.5 would multiply light by 1.5. Below k = 0.5 even
// a lamp near the viewer would make the rim unboundedly bright, so such k are not accepted. Above 10 all
// but the middle of a ball is black, in single precision even exactly.
//
// Sampling is exact, by a power of the cosine: the weight depends on the view alone.
#include "model/power_lobe.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Minnaert {
  Rgb<T> rho;
  T k;

  static ModelInfo info() {
    return {.name = "minnaert",
            .label = "Minnaert",
            .look = Look::Matte,
            .paper = "M. Minnaert: The Reciprocity Principle in Lunar Photometry, Astrophysical Journal 93, 1941",
            .equations = "f = rho (k + 1) / (2 pi) (cos theta_i cos theta_o)^(k - 1)",
            .doc =
                "Moons and planets by one number: below 1 the rim is brighter than that of a matte ball, above 1 "
                "darker.",
            .properties = {.conserving = false, .diffuse_limit = "k=1"},
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
  /// The albedo over rho.
  T seen(const Vec3<T>& wo) const { return named("seen", pow(maximum(wo.z, tiny<T>()), k - T(1))); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T both = named("both", maximum(wi.z * wo.z, tiny<T>()));
    return select(above(wi, wo), rho * (top() * pow(both, k - T(1))), Rgb<T>(T(0)));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), top() * pow(maximum(wi.z, tiny<T>()), k), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> wi = sample_power_lobe(k, u.y, u.z);
    return sample_if(above(wi, wo), wi, rho * seen(wo), pdf(wi, wo));
  }

  /// f cos(theta_i) is a function of the view times one of the light's cosine: a ramp is all of it but for the curve
  /// between two colours. Where the curve is hollow, the brightest colour is lowered by what straight lines add.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    Closure<T> ramp(ClosureKind::DiffuseRamp, rho * seen(wo));
    const T scale = (k + T(1)) / T(2);
    T rest = T(double(kRampSize - 1)) / (k + T(1));
    ramp.ramp[0] = Rgb<T>(T(0));
    for (int i = 1; i < kRampSize - 1; ++i) {
      const T height = pow(T(i / double(kRampSize - 1)), k);
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
