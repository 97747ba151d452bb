// SPDX-License-Identifier: GPL-3.0-or-later
// Hapke's surface of particles: the moon, dust, soil, powder. Lommel and Seeliger's law is a special case.
//
// B. Hapke: Bidirectional Reflectance Spectroscopy 1. Theory, JGR 86, 1981, and Theory of Reflectance and Emittance
// Spectroscopy, 2nd ed., 2012, with isotropic multiple scattering. For particles that scatter the share w of the light
// that they meet, and the phase angle g between the directions to the light and to the viewer,
//   f = w / (4 pi) / ((n.i) + (n.o)) [(1 + B(g)) p(g) + H_i H_o - 1],
//   B(g) = B0 / (1 + tan(g / 2) / h), the opposition surge: in front of a lamp particles hide their own shadows,
//   p(g) = (1 + c) / 2 P(b, cos g) + (1 - c) / 2 P(b, -cos g),  P(b, x) = (1 - b^2) / (1 - 2 b x + b^2)^(3/2),
// Henyey and Greenstein's function twice, backwards and forwards; with c = 1 or -1 it is one. The mean cosine of the
// scattering angle is -b c. The formula above is Hapke's r over (n.i). Published fits may have c > 1, which is not
// accepted here: p is negative for some of them.
//
// Choice `single` leaves H_i H_o - 1 off. With b = 0 and B0 = 0 this is the law of E. Lommel and H. von Seeliger,
// from the 1880s. Its albedo is w / 2 (1 - (n.o) log(1 + 1 / (n.o))).
//
// Of Hapke's two approximations of Chandrasekhar's function H this is the one of Bidirectional Reflectance Spectroscopy
// 5, Icarus 157, 2002: with y = sqrt(1 - w) and r0 = (1 - y) / (1 + y),
//   1 / H(x) = 1 - w x (r0 + (1 - 2 r0 x) / 2 log(1 + 1 / x)).
// It is 0 to 0.97 % below H, at any w and x; the one of 1981, (1 + 2 x) / (1 + 2 x y), is off by -4.0 to 3.2 %. With
// the true H, particles of w = 1 that scatter evenly lose nothing; these lose 0.6 to 1.4 %. Left out are macroscopic
// roughness (1984), porosity (2008), and coherent backscatter.
//
// Energy. Light that is scattered once depends on p, light that is scattered again does not, and B adds light. So
// energy is not conserved where w is close to 1. With w = 1 and B0 = 0 the albedo of backward scattering (b = 0.9,
// c = 1), seen from above, is 1.30, that of forward scattering (c = -1) 0.84. With b = 0 a wide surge, B0 = 1 and
// h = 1, makes it 1.09 from above and 1.23 from the horizon.
//
// Singularities. f is unbounded where both directions are close to the horizon, f cos(theta) is not. The surge has a
// cusp, but at a single direction, that to the viewer: there is no edge.
//
// Numerical stability. tan(g / 2) is |i - o| / |i + o|, and 1 - 2 b x + b^2 is (1 - b)^2 + b |i - o|^2. H - 1 is
// 1 / (1 - q) - 1 = q / (1 - q), so that H_i H_o - 1 has no cancellation where H is close to 1.
//
// Sampling is a mixture: a density between Lambert's and, for views from the horizon, a uniform one; and Henyey and
// Greenstein's lobes, whose directions below the horizon are reflected upwards. The surge is not sampled: it changes
// weights by 1 + B0 at most. The variance is 0.05 of the squared albedo by default, and at most 1.4 with b <= 0.8 and
// B0 <= 1.
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Hapke {
  Rgb<T> w;
  T b, c, B0, h;
  Choice scattering;

  enum { Multiple, Single };

  static ModelInfo info() {
    return {.name = "hapke",
            .label = "Hapke, Lommel-Seeliger",
            .look = Look::Matte,
            .paper = "B. Hapke: Bidirectional Reflectance Spectroscopy 1. Theory, JGR 86, 1981",
            .equations = "r / (n.i) with B, p and H of the book's 2nd ed., 2012; H of Icarus 157, 2002",
            .doc = "Dust or the moon: hardly darker at the rim, and brightest where the lamp is behind the viewer.",
            .properties = {.conserving = false,
                           .exact_sampling = false,
                           .albedo_table = false,  // not a polynomial in the colour
                           .fit_axis = "b"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(w, ColorSpec{"w",
                   "Particle Albedo",
                   {0.8, 0.8, 0.8},
                   "Share of the light that a particle scatters: 0.8 reflects about 40 % of the light, 0.5 about 20 %"}
             .at_most_one());
    v(b, NumberSpec{"b", "Lobe Strength", 0.3, 0, 0.95, 0, 0.8,
                    "Particles scatter evenly with 0; larger values narrow their lobes"});
    v(c, NumberSpec{"c", "Backward", 0.4, -1, 1, -1, 1, "1: particles scatter backwards, to the lamp; -1: forwards"});
    v(B0, NumberSpec{"b0", "Opposition Surge", 0.8, 0, 4, 0, 1,
                     "Relative increase of the brightness where the lamp is behind the viewer"});
    v(h, NumberSpec{"h", "Surge Width", 0.06, 1e-4, 10, 0.01, 1,
                    "Tangent of half the angle between lamp and viewer at which half of the surge is left"}
             .by_factors());
    v(scattering, ChoiceSpec{"scattering",
                             "Scattering",
                             {"multiple", "single"},
                             "single: light meets one particle only; Lommel and Seeliger's law with a lobe strength "
                             "and a surge of 0"});
  }

  /// P, from the squared distance of unit vectors with the cosine x.
  T P(const T& apart2) const {
    const T rest = sqr(T(1) - b) + b * apart2;
    return (T(1) - b) * (T(1) + b) / (rest * sqrt(rest));
  }

  /// q = 1 - 1 / H.
  Rgb<T> q(const T& cosTheta) const {
    const T x = maximum(cosTheta, tiny<T>()), L = named("L", log1p(T(1) / x));
    const Rgb<T> one(T(1)), r0 = w / sqr(one + sqrt(one - w));
    return w * x * (r0 + (one - r0 * (T(2) * x)) * (L / T(2)));
  }
  /// H - 1.
  Rgb<T> H_minus_1(const T& cosTheta) const {
    const Rgb<T> less = q(cosTheta);
    return less / (Rgb<T>(T(1)) - less);
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const Vec3<T> apart = difference_of_units(wi, wo), sum = sum_of_units(wi, wo);
    const T apart2 = named("apart2", dot(apart, apart)), sum2 = named("sum2", dot(sum, sum));
    const T p = named("p", ((T(1) + c) * P(apart2) + (T(1) - c) * P(sum2)) / T(2));
    const T wide = h * sqrt(sum2), B = named("B", B0 * wide / maximum(wide + sqrt(apart2), tiny<T>()));
    Rgb<T> scattered((T(1) + B) * p);
    if (scattering == Multiple) {
      const Rgb<T> Hi = H_minus_1(wi.z), Ho = H_minus_1(wo.z);
      scattered += Hi + Ho + Hi * Ho;
    }
    const T geometry = T(1) / (T(4) * pi<T>() * maximum(wi.z + wo.z, tiny<T>()));
    return select(above(wi, wo), w * scattered * geometry, Rgb<T>(T(0)));
  }

  /// The shares of the lobes about the viewer and opposite to it. The latter is mostly inside the surface.
  T share_back() const { return T(0.4) * b * (T(1) + c); }
  T share_on(const Vec3<T>& wo) const {
    return named("share_on", T(0.4) * b * (T(1) - c) * sqr(sqr(maximum(T(1) - wo.z, T(0)))));
  }
  /// The share of the uniform density in the rest.
  T level(const Vec3<T>& wo) const {
    const T low = maximum(T(1) - wo.z, T(0));
    return named("level", T(0.05) + T(0.7) * low * low * low);
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T apart2 = sqr(wi.x - wo.x) + sqr(wi.y - wo.y), sum2 = sqr(wi.x + wo.x) + sqr(wi.y + wo.y);
    // Of wi and of its mirror image below the surface.
    const T up = sqr(wi.z + wo.z), across = sqr(wi.z - wo.z);
    const T back = P(apart2 + across) + P(apart2 + up), on = P(sum2 + across) + P(sum2 + up);
    const T lobes = named("lobes", (share_back() * back + share_on(wo) * on) / (T(4) * pi<T>()));
    const T rest = (T(1) - share_back() - share_on(wo)) * everywhere_pdf(wi, level(wo));
    return select(above(wi, wo), lobes + rest, T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    // P is proportional to the density of x over the sphere: 1 - x, without cancellation.
    const T even = T(1) - b + T(2) * b * u.y;
    const T drop = named("drop", (T(1) - b) * (T(1) - u.y) * ((T(1) - b) * (T(1) + b) / even + T(1) - b) / even);
    const T phi = T(2) * pi<T>() * u.z, sine = sqrt(maximum(drop * (T(2) - drop), T(0)));
    const Vec3<T> lobe = about_axis(wo, Vec3<T>{sine * cos(phi), sine * sin(phi), T(1) - drop});
    const T back = share_back(), lobes = back + share_on(wo);
    const Vec3<T> about = select(u.x < back, lobe, lobe * T(-1));
    const Vec3<T> wi =
        select(u.x < lobes, Vec3<T>{about.x, about.y, abs(about.z)}, sample_everywhere(u.y, u.z, level(wo)));
    const T density = pdf(wi, wo);
    return sample_if(above(wi, wo), wi, eval(wi, wo) * (wi.z / maximum(density, tiny<T>())), density);
  }

  /// The albedo over w of particles that scatter evenly: 1 - sqrt(1 - w) H, or Lommel and Seeliger's.
  Rgb<T> albedo_over_w(const Vec3<T>& wo) const {
    const T x = maximum(wo.z, tiny<T>()), L = log1p(T(1) / x);
    if (scattering == Single) return Rgb<T>((T(1) - x * L) / T(2));
    const Rgb<T> one(T(1)), y = one + sqrt(one - w), r0 = w / sqr(y);
    return (one + H_minus_1(wo.z)) * (one / y - (r0 + (one - r0 * (T(2) * x)) * (L / T(2))) * x);
  }

  /// All but the surge, with the mean of p over the azimuth, by two points of a quadrature.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const Rgb<T> Ho = scattering == Multiple ? H_minus_1(wo.z) : Rgb<T>(T(0)), albedo = albedo_over_w(wo);
    const T so = sqrt(sin2_theta(wo) / T(2));
    Closure<T> ramp(ClosureKind::DiffuseRamp, w * albedo);
    ramp.ramp[0] = Rgb<T>(T(0));
    for (int i = 1; i < kRampSize; ++i) {
      const double c_i = i / double(kRampSize - 1), s_i = std::sqrt(1 - c_i * c_i);
      const T middle = T(2 * c_i) * wo.z, aside = T(2 * s_i) * so, two(2);
      const T back = P(two - middle - aside) + P(two - middle + aside);
      const T on = P(two + middle - aside) + P(two + middle + aside);
      Rgb<T> scattered(((T(1) + c) * back + (T(1) - c) * on) / T(4));
      if (scattering == Multiple) {
        const Rgb<T> Hi = H_minus_1(T(c_i));
        scattered += Hi + Ho + Hi * Ho;
      }
      ramp.ramp[std::size_t(i)] = scattered * (T(c_i) / (T(4) * (T(c_i) + maximum(wo.z, T(0))))) / albedo;
    }
    return {ramp};
  }

  /// Lambert's law. p is convex in cos g. With its minimum over the angles that the view admits, [p + H_i H_o - 1] is
  /// concave in (n.i), if the approximation of H is like H. Divided by (n.i) + (n.o) it is least for light at the
  /// horizon or at the normal.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T to = pow(T(1) + c, T(0.4)), from = pow(T(1) - c, T(0.4)), so = sqrt(sin2_theta(wo));
    const T middle = (T(1) + b * b) / maximum(T(2) * b, tiny<T>()) * ((from - to) / (from + to));
    const T x = minimum(maximum(middle, -so), T(1));
    const T least = named("least", ((T(1) + c) * P(T(2) * (T(1) - x)) + (T(1) - c) * P(T(2) * (T(1) + x))) / T(2));
    Rgb<T> low(least), high(least);
    if (scattering == Multiple) {
      const Rgb<T> Ho = H_minus_1(wo.z), H1 = H_minus_1(T(1));
      low += Ho;
      high += H1 + Ho + H1 * Ho;
    }
    low = low / maximum(wo.z, tiny<T>());
    high = high / (T(1) + maximum(wo.z, T(0)));
    return {Closure<T>(ClosureKind::Diffuse, w * ((low + high - sqrt(sqr(low - high))) / T(8)))};
  }
};

BRDFC_MODEL(Hapke)
BRDFC_UNDER(Hapke)

}  // namespace brdfc
