// SPDX-License-Identifier: GPL-3.0-or-later
// Metal or plastic below a thin clear film, whose two surfaces make light of some colours cancel: oil on water,
// tempered steel, anodised titanium.
//
// L. Belcour, P. Barla: A Practical Extension to Microfacet Theory for the Modeling of Varying Iridescence, ACM
// Transactions on Graphics 36(4), 2017. Microfacets f = F D G / (4 (n.i)(n.o)) of ggx with Smith's correlated masking
// (model/facets.h), where F is G. B. Airy's reflectance (1833) of a film with the index n_2 and the thickness d on a
// base with n_3 + i k_3, averaged over the spectrum. Light comes from air, n_1 = 1.
//
// Of each polarisation, with r_12 of the film's upper surface, which is real, r_23 of the lower one, R = |r|^2 and
// z = -r_12 r_23 exp(2 pi i D / lambda), D = 2 n_2 d cos theta_2,
//   r = (r_12 + r_23 exp(2 pi i D / lambda)) / (1 - z).
// The paper has |r|^2 as a series, C_0 + sum C_m cos(m ...), its eqs. 7 and 8. Factored, it is
//   |r|^2 = 1 - Q (1 + 2 Re sum z^m),  m = 1, 2, ...,
//   Q = (1 - R_12) (1 - R_23) / (1 - R_12 R_23),
// from which one reads: Q is what the base takes on average over thicknesses; a base that reflects all light has no
// colours; R is from 0 to 1; and at d = 0 it is Fresnel's reflectance of the base, as it is for n_2 = 1.
//
// Spectrum. Only exp(2 pi i D / lambda) depends on the wavelength: each channel has its own n_3 + i k_3, as in
// fresnel_conductor, and n_2 is constant. So z^m is averaged by the Fourier transform of the channel's sensitivity over
// 1 / lambda, at m D (paper, sec. 4). The sensitivity of a channel of the working space is the CIE 1931 observer times
// D65, as elsewhere (model/spectrum.h), here as a sum of seven Gaussians that all channels share, with weights for each
// of three working spaces. They are evenly spaced and equally wide, so that all transforms need two angles and one
// exponential. They were fitted to the table's transforms: in Rec.709 these differ by at most 0.006 for D up to 3 um
// and 0.03 for any. The paper has four Gaussians for X, Y and Z under a constant illuminant, which are converted to RGB
// afterwards.
//
// The series. The paper takes m to 2 or 3, and lets n_2 tend to 1 below d = 30 nm, since the remainder is large where
// colours overlap. Here m = 1 and 2 are as above, and the sum of all others is geometric,
//   sum_(m > 2) z^m = z^2 rho y / (1 - rho y),
// with rho = -r_12 r_23 and y the ratio of the transform at 3 D to that at 2 D of one of the Gaussians (red) or the
// mean of two (green, blue). This is exact at d = 0.
//
// Error, from tests/models/thin_film_test.cpp, against transfer matrices summed over wavelengths: 0.0008 of the light
// on average and 0.025 at most in Rec.709, a little less in the others. One n and k for each channel instead of a
// metal's spectrum adds more: 0.0012 to 0.0037 on average and 0.09 at most for silver, iron, chromium, aluminium and
// titanium; 0.016 and 0.2 for copper, 0.018 and 0.31 for gold, where a film turns colours that the metal itself has.
//
// Colours outside the working space have channels below 0 or above 1. The former are 0 here, since Cycles drops
// closures of negative weight, the latter 1. In Rec.709 this befalls the red of some cyan and green, a percent of all
// clear films on a clear base, by up to 0.1; in Rec.2020 and ACEScg hardly any.
//
// Numerical stability. q_2 = n_2 cos theta_2 and q_3 = u + i v = sqrt((n_3 + i k_3)^2 - sin^2) give r_23 = (a - b) /
// (a + b) with (a, b) = (q_2, q_3) or (e_3 q_2, e_2 q_3), e = n^2. With X = |a|^2, Y = |b|^2 and Z + i I = 2 a conj(b),
//   1 - R_23 = 2 Z / (X + Y + Z),  r_23 = (X - Y + i I) / (X + Y + Z),
// where Re(e_3 conj(q_3)) = u (|q_3|^2 + sin^2) and Im = v (|q_3|^2 - sin^2), without the cancellation of n^2 - k^2.
// What remains is that of 1 - Q (...) where hardly any light is reflected: the error is one of rounding 1, not F. It
// counts where F is below some 1e-3, for a film that matches a clear base, and is less than a picture shows.
#include "model/base_terms.h"
#include "model/facets.h"
#include "model/fresnel.h"

namespace brdfc {
namespace {

/// The Gaussians in 1 / um: the middle one's centre, the distance between two, and the width; and the weights of each
/// for r, g, b by working space.
constexpr double kMiddle = 1.9761, kApart = 0.1110, kWidth = 0.0710;
constexpr std::size_t kGaussians = 7;
using Weights = std::array<std::array<double, 3>, kGaussians>;
constexpr std::array<Weights, 3> kWeights = {{
    {{{1.2946, -0.1315, -0.0074},
      {0.2709, 0.4122, -0.0609},
      {-0.3731, 0.6014, -0.0569},
      {-0.2209, 0.1877, 0.0019},
      {-0.0675, 0.0344, 0.2030},
      {0.0401, -0.0587, 0.6306},
      {0.0559, -0.0455, 0.2897}}},
    {{{0.7686, -0.0316, 0.0030},
      {0.3031, 0.3970, -0.0138},
      {-0.0385, 0.5265, -0.0041},
      {-0.0768, 0.1575, 0.0146},
      {-0.0223, 0.0293, 0.1837},
      {0.0332, -0.0440, 0.5602},
      {0.0327, -0.0347, 0.2564}}},
    {{{0.7487, -0.0298, 0.0059},
      {0.3032, 0.3959, -0.0022},
      {-0.0273, 0.5241, 0.0087},
      {-0.0717, 0.1566, 0.0175},
      {-0.0201, 0.0295, 0.1790},
      {0.0346, -0.0425, 0.5429},
      {0.0326, -0.0338, 0.2482}}},
}};

/// The channels in place of a number.
template <class T> struct ComplexRgb { Rgb<T> re, im; };
template <class T> ComplexRgb<T> operator*(const ComplexRgb<T>& a, const ComplexRgb<T>& b) {
  return {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

/// max(x, 0) by channel. Recorded colours have no maximum.
template <class T> Rgb<T> positive_part(const Rgb<T>& x) { return (x + sqrt(x * x)) / T(2); }

}  // namespace

template <class T> struct ThinFilm {
  T thickness, film_ior, ax, ay;
  T n_r, n_g, n_b, k_r, k_g, k_b;
  Choice space;

  static ModelInfo info() {
    return {.name = "thin_film",
            .label = "Thin Film",
            .look = Look::Metal,
            .paper =
                "L. Belcour, P. Barla: A Practical Extension to Microfacet Theory for the Modeling of Varying "
                "Iridescence, ACM Transactions on Graphics 36(4), 2017",
            .equations = "eqs. 1, 7 and 8 in a factored form; sec. 4 with other Gaussians",
            .doc =
                "Metal or plastic below a thin clear film, which makes rainbow colours: oil, tempered steel, "
                "anodised titanium.",
            .properties = {.isotropic = false,
                           .positive = false,  // colours outside the working space
                           .smooth = false,    // where they begin
                           .exact_sampling = false,
                           .specular_limit = "ax=1e-4 ay=1e-4",
                           .albedo_table = false},  // depends on too many numbers
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(thickness, NumberSpec{"thickness", "Film Thickness", 300, 0, 10000, 0, 1500,
                            "Thickness of the film in nanometres: colours appear from 100 on, and fade above 1000"}
                     .by_factors());
    v(film_ior, NumberSpec{"film_ior", "Film IOR", 1.5, 1, 5, 1, 3,
                           "Refractive index of the film: water 1.33, oil 1.5, oxides of metals 2 to 2.7"}
                    .by_factors());
    v(ax, NumberSpec{"ax", "Roughness X", 0.1, 1e-4, 1, 0.02, 1,
                     "alpha along the tangent: the square of the Roughness of Blender's nodes"}
              .by_factors());
    v(ay, NumberSpec{"ay", "Roughness Y", 0.1, 1e-4, 1, 0.02, 1,
                     "alpha across the tangent: the square of the Roughness of Blender's nodes"}
              .by_factors());
    // Titanium.
    const auto n = [&](T& value, const char* name, const char* label, double initial, Optical what) {
      v(value, NumberSpec{name, label, initial, 1e-3, 100, 0.05, 5, "Real part of the base's refractive index"}
                   .by_factors()
                   .as(what)
                   .in("Base"));
    };
    const auto k = [&](T& value, const char* name, const char* label, double initial, Optical what) {
      v(value, NumberSpec{name, label, initial, 0, 100, 0, 10,
                          "Imaginary part of the base's refractive index: 0 for plastic and glass"}
                   .as(what)
                   .in("Base"));
    };
    n(n_r, "n_r", "n Red", 2.74, Optical::IndexRed);
    n(n_g, "n_g", "n Green", 2.51, Optical::IndexGreen);
    n(n_b, "n_b", "n Blue", 2.24, Optical::IndexBlue);
    k(k_r, "k_r", "k Red", 3.84, Optical::ExtinctionRed);
    k(k_g, "k_g", "k Green", 3.4, Optical::ExtinctionGreen);
    k(k_b, "k_b", "k Blue", 3.01, Optical::ExtinctionBlue);
    v(space, ChoiceSpec{"space",
                        "Working Space",
                        {"rec709", "rec2020", "acescg"},
                        "The working space in which the film's colours are computed: that of the file"});
  }

  Facets<T> surface() const { return {ax, ay, false, false}; }

  /// sum_j w_j exp(i j x), j = -3, ..., 3, for each channel: with cos j x = T_j(cos x) and sin j x = sin x U_(j-1)(cos
  /// x), Chebyshev's polynomials, it is P(cos x) + i sin x Q(cos x).
  ComplexRgb<T> comb(const T& cosine, const T& sine) const {
    const Weights& w = kWeights[std::size_t(int(space))];
    const auto even = [&](std::size_t c, std::size_t j) { return j > 0 ? w[3 + j][c] + w[3 - j][c] : w[3][c]; };
    const auto odd = [&](std::size_t c, std::size_t j) { return w[3 + j][c] - w[3 - j][c]; };
    const auto by_channel = [](const auto& f) { return Rgb<T>{T(f(0)), T(f(1)), T(f(2))}; };
    const Rgb<T> P0 = by_channel([&](std::size_t c) { return even(c, 0) - even(c, 2); }),
                 P1 = by_channel([&](std::size_t c) { return even(c, 1) - 3 * even(c, 3); }),
                 P2 = by_channel([&](std::size_t c) { return 2 * even(c, 2); }),
                 P3 = by_channel([&](std::size_t c) { return 4 * even(c, 3); }),
                 Q0 = by_channel([&](std::size_t c) { return odd(c, 1) - odd(c, 3); }),
                 Q1 = by_channel([&](std::size_t c) { return 2 * odd(c, 2); }),
                 Q2 = by_channel([&](std::size_t c) { return 4 * odd(c, 3); });
    return {P0 + (P1 + (P2 + P3 * cosine) * cosine) * cosine, (Q0 + (Q1 + Q2 * cosine) * cosine) * sine};
  }
  static ComplexRgb<T> turned(const ComplexRgb<T>& a, const T& re, const T& im) {
    return {a.re * re - a.im * im, a.re * im + a.im * re};
  }

  /// Averages over the channels' spectra of exp(i m 2 pi D / lambda), for m = 1 and 2; and y.
  struct Averages {
    ComplexRgb<T> one, two, ratio;
  };
  Averages averages(const T& q2) const {
    const T turn = named("turn", q2 * thickness * (T(4e-3) * pi<T>()));  // 2 pi D, in um
    const T phase = named("phase", turn * T(kMiddle)), apart = named("apart", turn * T(kApart));
    const T g = named("g", exp(sqr(turn) * T(-sqr(kWidth) / 2))), g4 = named("g4", sqr(g * g));
    const T re = named("re", g * cos(phase)), im = named("im", g * sin(phase));
    const T c = named("cos_apart", cos(apart)), s = named("sin_apart", sin(apart)), c2 = named("c2", c * c);
    const T again = named("g2", g * g);
    return {turned(comb(c, s), re, im),
            turned(comb(T(2) * c2 - T(1), T(2) * s * c), (re - im) * (re + im) * again, T(2) * re * im * again),
            // exp(-3 i x); exp(-i x) cos x and exp(2 i x) cos x, the means of two.
            turned({Rgb<T>{(T(4) * c2 - T(3)) * c, c2, (T(2) * c2 - T(1)) * c},
                    Rgb<T>{T(1) - T(4) * c2, -c, T(2) * c2} * s},
                   re * g4, im * g4)};
  }

  /// 1 - |r|^2 of one polarisation.
  static Rgb<T> absorbed(const Averages& e, const T& r12, const T& T12, const Rgb<T>& X, const Rgb<T>& Y,
                         const Rgb<T>& Z, const Rgb<T>& I) {
    const Rgb<T> D = X + Y + Z, A23 = named("A_23", Z * T(2) / D);
    const T through = maximum(T12, tiny<T>());
    const Rgb<T> Q = named("Q", A23 * through / (Rgb<T>(through) + A23 * sqr(r12)));
    const ComplexRgb<T> rho = {named("rho_re", (Y - X) * r12 / D), named("rho_im", I * -r12 / D)};
    const ComplexRgb<T> third = rho * e.ratio, high = rho * rho * e.two;
    const Rgb<T> left = Rgb<T>(T(1)) - third.re;
    const Rgb<T> geometric =
        (high.re * left - high.im * third.im) / (left * left + third.im * third.im + Rgb<T>(tiny<T>()));
    return Q * (Rgb<T>(T(1)) + ((rho * e.one).re + geometric) * T(2));
  }

  /// The reflectance of a facet, of (o.h) and 1 - (o.h).
  Rgb<T> F(const T& c, const T& one_minus_oh) const {
    const T s2 = named("sin2", one_minus_oh * (T(1) + c));
    const T step = named("step", (film_ior - T(1)) * (film_ior + T(1))), e2 = T(1) + step;
    const T q2sq = maximum(step + c * c, tiny<T>()), q2 = named("q_2", sqrt(q2sq));
    const Averages averaged = averages(q2);

    struct Channel {
      T u, v, modulus, e3;
    };
    const auto channel = [&](const T& n, const T& k) {
      const ConductorRoot<T> q3 = conductor_root(s2, n, k);
      return Channel{q3.u, named("v_root", sqrt(q3.v2)), q3.modulus, n * n + k * k};
    };
    const Channel r = channel(n_r, k_r), g = channel(n_g, k_g), b = channel(n_b, k_b);
    const Rgb<T> u = {r.u, g.u, b.u}, v = {r.v, g.v, b.v}, modulus = {r.modulus, g.modulus, b.modulus};
    const Rgb<T> e3 = {r.e3, g.e3, b.e3}, sin2(s2);

    const T ds = named("d_s", T(1) / sqr(c + q2)), dp = named("d_p", T(1) / sqr(e2 * c + q2)), cq = T(4) * c * q2;
    const Rgb<T> of_s =
        absorbed(averaged, -step * ds, cq * ds, Rgb<T>(q2sq), modulus, u * (T(2) * q2), v * (T(-2) * q2));
    const Rgb<T> of_p =
        absorbed(averaged, step * (e2 - s2 * (e2 + T(1))) * dp, e2 * cq * dp, e3 * e3 * q2sq, modulus * sqr(e2),
                 u * (modulus + sin2) * (T(2) * q2 * e2), v * (modulus - sin2) * (T(2) * q2 * e2));
    return named("F", positive_part(Rgb<T>(T(1)) - positive_part((of_s + of_p) / T(2))));
  }

  T shape(const Vec3<T>& wi, const Vec3<T>& wo) const { return surface().smith_shape(true, wi, wo); }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return F(k.oh, k.one_minus_oh) * select(above(wi, wo), surface().D(k.h) * shape(wi, wo), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return surface().reflected_pdf(wi, wo); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Vec3<T> h = surface().sample_normal(wo, u).h;
    const Vec3<T> wi = h * (T(2) * dot(wo, h)) - wo;
    const HalfVector<T> k(wi, wo);
    const T seen = surface().visible(k.h.z, k.oh, wo);
    const T weight = shape(wi, wo) * maximum(wi.z, T(0)) / maximum(seen, tiny<T>());
    return sample_if(above(wi, wo), wi, F(k.oh, k.one_minus_oh) * weight, surface().D(k.h) * seen);
  }

  /// The same facets, with the reflectance of the middle of the lobe.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T height = minimum(lobe_height(wo.z, T(0.7) * (sqr(ax * wo.x) + sqr(ay * wo.y))), T(1));
    return {facets(ClosureKind::Ggx, F(height, T(1) - height), ax, ay, T(0))};
  }
};

BRDFC_MODEL(ThinFilm)

}  // namespace brdfc
