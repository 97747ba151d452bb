// SPDX-License-Identifier: GPL-3.0-or-later
// Microfacet reflection whose factors are curves instead of formulas, so that it can follow a measured material.
//
// M. M. Bagher, J. Snyder, D. Nowrouzezahrai: A Non-Parametric Factor Microfacet Model for Isotropic BRDFs, ACM
// Transactions on Graphics 35(5), 2016. There
//   f = rho / pi + s D(theta_h) F(theta_d) G(theta_i) G(theta_o) / (4 cos theta_i cos theta_o)
// with tabulated D, F and G in each channel. Here the tables have few knots, so that they can be parameters:
//   D = d(ln q) / (pi a_x a_y cos^4 theta_h q^2),  q = 1 + tan^2 theta_h (cos^2 phi_h / a_x^2 + sin^2 phi_h / a_y^2),
// where d = 1 gives the distribution of Trowbridge and Reitz (GGX). ln d is linear in ln q between its knots, ln F
// linear in cos theta_d, and ln G linear in ln cos theta. D thus consists of powers of q: Trowbridge and Reitz's
// distribution with any exponent is such a curve, and so is a constant. Beyond its last knot, d is constant; at heights
// below the last knot of G, G is proportional to the height, so that f stays finite.
//
// Numerical stability: the logarithms of the strength, d, F and G are added. Each may be as large as 70, so that f has
// a rounding error of some hundred units in the last place where large ones cancel.
//
// Lobes that are not about the half vector. Many models and materials have lobes about the mirror direction instead,
// which are no such products: seen obliquely, they are wider across the plane of incidence than half vectors allow.
// With z = cos theta_i - cos theta_o and the horizontal vector p = i + o, the squared sine of half the angle between i
// and the mirror image of o is (p^2 + z^2) / 4, while tan^2 theta_h = p^2 / (cos theta_i + cos theta_o)^2. The numbers
// `widening` and `heights`, here e and w, lead from the one to the other, and farther:
//   q - 1 = m^e [(1 - w) (s_x^2 / a_x^2 + s_y^2 / a_y^2) + w s_z^2 / (a_x a_y)],
//   m = (cos theta_i + cos theta_o) / 2,  (s_x, s_y, s_z) = (p_x, p_y, z) / (2 m).
//   e = 0, w = 0: the half vector, as above. 2, 1/2: the mirror direction. 2, 0: p alone, the difference to the mirror
//   direction projected onto the surface, as in the smooth surfaces by which Low et al. (2012) describe the materials
//   in MERL's database. 4, 1: the heights cos^2 theta alone, as in the lossless lobes of Radziszewski and Alda. -2, 0:
//   on the halfway vector disk of Edwards et al., whose lobes narrow towards the horizon.
// 1 / cos^4 theta_h belongs to half vectors: D has its power max(0, 1 - 2 w) min(1, max(0, 1 - e / 2)), with which
// f stays finite at the horizon. All of this is symmetric in i and o. Tried in one channel with values of the models at
// their defaults, percent of the light that is misplaced; k is one number for e = 2 - 2 k and w = max(0, (1 - k) / 2):
//                               ashikhmin_shirley  edwards  lafortune  lossless  max_phong  modified_phong  radz._alda
//   k = 1                                    12       41         27        43         30              21          22
//   k = 1 or 0                               12       41        2.3        34        3.8            0.76          10
//   k                                        12       24        2.2       8.8        2.9            0.76         9.2
//   w, a knotted width over theta           9.4       26        5.8        14        3.6             3.0         7.1
//   a sum of both products of k = 1          2         32        1.8        32        3.4            0.76         5.5
//   k and rim                               2.2       24        2.2       8.5        2.9            0.76         9.2
//   e, w and rim                            1.4       24        1.3       6.4        2.2            0.77         8.5
// MERL's materials as Low et al. describe them: up to 26 with k and rim, at most 1.9 with e, w and rim.
// Half of what depends on which of two directions is the light's can't be avoided: 24 of edwards, 11 of phong, 5 of
// glossy_reflector. A retroreflecting lobe is a curve F; turning the view about the normal instead was no better.
//
// Matte light: rho / pi (1 - rim (1 - cos theta_i)^2) (1 - rim (1 - cos theta_o)^2) is darker where a coat reflects
// much. Ashikhmin and Shirley's is nearly this for rim = 1.
//
// f is reciprocal. Like measured data, it may reflect more light than arrives.
//
// Sampling: a matte direction or a half vector. The pdf of ln q, nearly as of D with the largest d of the channels,
// consists of exponentials, whose integrals are inverted in closed form: fewer than D has, for shorter shaders. Half
// vectors are sampled as if q - 1 were the quadratic form of the slopes that it is where the slopes are small, for half
// vectors everywhere. Elsewhere their pdf may be far too small, so some directions are matte ones in any case.
#include "model/base_terms.h"
#include "model/half_vector.h"
#include "model/stand_in.h"

namespace brdfc {
namespace {

// Knots of d in ln q: denser where most of the light is, and out to slopes of 250 a.
constexpr std::array<double, 14> kD = {0, 0.3, 0.6, 0.9, 1.25, 1.65, 2.1, 2.6, 3.2, 4, 5, 6.5, 8.5, 11};
// Knots of F in 1 - cos theta_d: denser at 0, where a surface may return light towards its source.
constexpr std::array<double, 7> kF = {0, 0.05, 0.2, 0.4, 0.6, 0.8, 1};
// Knots of G in -log2 cos theta. G = 1 at the first.
constexpr std::array<double, 5> kG = {0, 1, 2, 3, 4};

// Of the knots of d, those of the curve that slopes are sampled by.
constexpr std::array<std::size_t, 8> kSampled = {0, 1, 3, 5, 7, 9, 11, 13};
constexpr std::array<double, kSampled.size()> kX = [] {
  std::array<double, kSampled.size()> out{};
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = kD[kSampled[k]];
  return out;
}();

constexpr double kLn2 = 0.69314718055994530942;

/// How much of each piece between knots lies below x, from 0 to 1.
template <std::size_t N, class T> std::array<T, N - 1> passed(const std::array<double, N>& knots, const T& x) {
  std::array<T, N - 1> out;
  for (std::size_t k = 0; k + 1 < N; ++k) out[k] = clamp01((x - T(knots[k])) / T(knots[k + 1] - knots[k]));
  return out;
}
/// The curve through values at knots, which is linear between them and constant beyond.
template <class V, std::size_t N, class T> V curve(const std::array<V, N>& at, const std::array<T, N - 1>& passed) {
  V sum = at[0];
  for (std::size_t k = 0; k + 1 < N; ++k) sum = sum + (at[k + 1] - at[k]) * passed[k];
  return sum;
}

/// Weights of the knots of d in the integrals of D over slopes, times powers 0 to 3 of y = ln(q - 1), the logarithm of
/// the squared slope in units of a. There GGX, d = 1, has the logistic distribution e^-y / (1 + e^-y)^2. Between knots
/// d is taken for linear.
using SlopeMoments = std::array<std::array<double, 4>, kD.size()>;
const SlopeMoments& slope_moments() {
  static const SlopeMoments made = [] {
    SlopeMoments out{};
    constexpr double kEnd = 40, kStep = 1. / 256;
    for (double y = -kEnd; y <= kEnd; y += kStep) {
      const double x = std::log1p(std::exp(y)), weight = std::exp(-x) * -std::expm1(-x) * kStep;
      const std::array<double, kD.size() - 1> part = passed(kD, x);
      for (std::size_t k = 0; k < kD.size(); ++k) {
        const double hat = (k == 0 ? 1 : part[k - 1]) - (k + 1 == kD.size() ? 0 : part[k]);
        for (std::size_t power = 0; power < 4; ++power) out[k][power] += hat * weight * std::pow(y, double(power));
      }
    }
    return out;
  }();
  return made;
}
/// Their variance of y for GGX.
constexpr double kSpreadOfGgx = kPi * kPi / 3;

}  // namespace

template <class T> struct Factors {
  Rgb<T> rho;
  T rim, strength, ax, ay, widening, heights;
  std::array<Rgb<T>, kD.size()> d;
  std::array<Rgb<T>, kF.size()> f;
  std::array<T, kG.size() - 1> g;

  static ModelInfo info() {
    return {.name = "factors",
            .label = "Microfacet Factors",
            .look = Look::Special,
            .paper =
                "M. M. Bagher, J. Snyder, D. Nowrouzezahrai: A Non-Parametric Factor Microfacet Model for "
                "Isotropic BRDFs, ACM TOG 35(5), 2016",
            .equations = "f = rho / pi + s D(theta_h) F(theta_d) G(theta_i) G(theta_o) / (4 cos theta_i cos theta_o)",
            .doc = "Microfacets whose distribution, Fresnel term and shadowing are curves, for measured materials.",
            .properties = {.conserving = false,  // as measured data are not
                           .isotropic = false,
                           .smooth = false,  // the curves have knots
                           .exact_sampling = false,
                           .diffuse_limit = "strength=0",
                           .albedo_table = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Matte", {0.1, 0.03, 0.02}, "Share of the light that is reflected in all directions"});
    v(rim, NumberSpec{"rim", "Matte Rim", 0, 0, 1, 0, 1, "Darkens the matte light towards grazing angles"});
    v(strength, NumberSpec{"strength", "Strength", 1, 0, 0x1p99, 0, 4, "Factor of the highlight"}.by_factors());
    v(ax, NumberSpec{"ax", "Roughness X", 0.2, 1e-4, 1, 0.02, 0.5, "Unit of the slope along the tangent"}.by_factors());
    v(ay,
      NumberSpec{"ay", "Roughness Y", 0.2, 1e-4, 1, 0.02, 0.5, "Unit of the slope across the tangent"}.by_factors());
    v(widening, NumberSpec{"widening", "Widening", 0, -2, 4, -2, 4,
                           "How the lobe widens towards grazing angles: 0 as one of facets, 2 as one about the mirror "
                           "direction, less than 0 narrows it"});
    v(heights, NumberSpec{"heights", "Heights", 0, 0, 1, 0, 1,
                          "How the height of the light counts beside half vectors: 0 not, as for facets; 0.5 as for a "
                          "round lobe about the mirror direction; 1 alone"});
    static constexpr const char* kNames[] = {"d0", "d1", "d2", "d3",  "d4",  "d5",  "d6",
                                             "d7", "d8", "d9", "d10", "d11", "d12", "d13"};
    static constexpr const char* kLabels[] = {"Facets 0",  "Facets 1",  "Facets 2",  "Facets 3", "Facets 4",
                                              "Facets 5",  "Facets 6",  "Facets 7",  "Facets 8", "Facets 9",
                                              "Facets 10", "Facets 11", "Facets 12", "Facets 13"};
    for (std::size_t k = 0; k < d.size(); ++k)
      v(d[k], ColorSpec{kNames[k],
                        kLabels[k],
                        {1, 1, 1},
                        "Facets at a knot, in units of GGX: 0 is where they face the normal, 13 the steepest"}
                  .in("Curves"));
    static constexpr const char* kFresnel[] = {"f0", "f1", "f2", "f3", "f4", "f5", "f6"};
    static constexpr const char* kFresnelLabels[] = {"Fresnel 0", "Fresnel 1", "Fresnel 2", "Fresnel 3",
                                                     "Fresnel 4", "Fresnel 5", "Fresnel 6"};
    for (std::size_t k = 0; k < f.size(); ++k) {
      const double schlick = 0.05 + 0.95 * pow5(kF[k]);
      v(f[k], ColorSpec{kFresnel[k],
                        kFresnelLabels[k],
                        {schlick, schlick, schlick},
                        "Reflectance of a facet at a knot: 0 is seen and lit from the front, 6 from the side"}
                  .in("Curves"));
    }
    static constexpr const char* kShadowing[] = {"g1", "g2", "g3", "g4"};
    static constexpr const char* kShadowingLabels[] = {"Visibility 1", "Visibility 2", "Visibility 3", "Visibility 4"};
    static constexpr double kVisible[] = {0.97, 0.88, 0.7, 0.45};
    for (std::size_t k = 0; k < g.size(); ++k)
      v(g[k], NumberSpec{kShadowing[k], kShadowingLabels[k], kVisible[k], 0, 1, 0, 1,
                         "Share of the facets that are seen where the cosine to the normal is 1/2, 1/4, 1/8 or 1/16"}
                  .in("Curves"));
  }

  template <class V, std::size_t N> static std::array<V, N> logs(const std::array<V, N>& heights) {
    std::array<V, N> out;
    for (std::size_t k = 0; k < N; ++k) out[k] = log(heights[k] + V(tiny<T>()));
    return out;
  }

  /// How much of 1 / cos^4 theta_h the distribution has.
  T of_facets() const { return maximum(T(1) - T(2) * heights, T(0)) * clamp01(T(1) - T(0.5) * widening); }
  /// m^e.
  T narrowing(const T& m2) const { return exp(T(0.5) * widening * log(m2)); }

  /// q - 1, 1 / cos^2 theta_h, and 1 - o.h.
  struct Facet {
    T s2, inverse_cos2, one_minus_oh;
  };
  Facet facet(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> half(wi, wo);
    const Slopes<T> slope(half.h);
    const T m = named("mean_height", maximum((wi.z + wo.z) / T(2), T(1e-7)));
    const T s2 = (T(1) - heights) * (sqr(slope.x / ax) + sqr(slope.y / ay)) +
                 heights * named("height_difference", sqr((wi.z - wo.z) / (T(2) * m)) / ax / ay);
    return {named("s2", narrowing(m * m) * s2), slope.inverse_cos2(), half.one_minus_oh};
  }

  /// The matte light's part of one direction.
  T matte_at(const T& cosTheta) const { return T(1) - rim * sqr(T(1) - cosTheta); }

  /// ln G(theta).
  T log_visibility(const T& cosTheta) const {
    std::array<T, kG.size()> at = {T(0)};
    for (std::size_t k = 0; k < g.size(); ++k) at[k + 1] = log(g[k] + tiny<T>());
    return named("log_G", curve(at, passed(kG, log(maximum(cosTheta, tiny<T>())) * T(-1 / kLn2))));
  }
  /// G / cos theta; below the last knot it is constant.
  static T least_height(const T& cosTheta) { return maximum(cosTheta, T(1. / 16)); }
  /// The product of the strength, d, F and both G. Their logarithms are added, since one may be as large as others are
  /// small.
  Rgb<T> product(const T& log_q, const T& one_minus_cosTheta_d, const T& log_visible) const {
    const Rgb<T> log_d = curve(logs(d), passed(kD, log_q));
    const Rgb<T> log_f = curve(logs(f), passed(kF, one_minus_cosTheta_d));
    return exp(log_d + log_f + Rgb<T>(log_visible + log(strength + tiny<T>())));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const Facet m = facet(wi, wo);
    const T visible = log_visibility(wi.z) + log_visibility(wo.z);
    // 1 / (a_x a_y q^2 cos^4 theta_h), divided by one factor at a time: q^2 alone may overflow.
    const T q = T(1) + m.s2, facing = named("facing", exp(of_facets() * log(m.inverse_cos2)));
    const T density = named("density", facing / (ax * q) * (facing / (ay * q)));
    const T scale = density / (T(4) * pi<T>() * least_height(wi.z) * least_height(wo.z));
    const Rgb<T> matte = rho * (T(kInvPi) * matte_at(wi.z) * matte_at(wo.z));
    return select(above(wi, wo), matte + product(log1p(m.s2), m.one_minus_oh, visible) * scale, Rgb<T>(T(0)));
  }

  /// The pdf of x = ln q: the exponential of a curve, e^(E(x)), divided by its integral. E = ln d - x, where d is the
  /// lowest curve over kX of which no knot of any channel is above.
  struct Slant {
    std::array<T, kX.size()> log_d;
    std::array<T, kX.size()> before;  ///< the integral up to each knot
    T total;
  };
  /// (e^t - 1) / t.
  static T expm1_over(const T& t) {
    const auto small = abs(t) < T(1e-4);
    return select(small, T(1) + t / T(2), expm1(t) / select(small, T(1), t));
  }
  /// The change of E over a piece, and its integral.
  static T rise(const std::array<T, kX.size()>& log_d, std::size_t k) {
    return log_d[k + 1] - log_d[k] - T(kX[k + 1] - kX[k]);
  }
  Slant slant() const {
    Slant out;
    for (std::size_t k = 0; k < kX.size(); ++k) {
      // The knots between those beside it.
      const std::size_t first = k == 0 ? 0 : kSampled[k - 1] + 1;
      const std::size_t end = k + 1 == kX.size() ? kD.size() : kSampled[k + 1];
      T highest = max_component(d[first]);
      for (std::size_t i = first + 1; i < end; ++i) highest = maximum(highest, max_component(d[i]));
      out.log_d[k] = log(highest + tiny<T>());
    }
    T sum(0);
    for (std::size_t k = 0; k + 1 < kX.size(); ++k) {
      out.before[k] = sum;
      sum = sum + exp(out.log_d[k] - T(kX[k])) * T(kX[k + 1] - kX[k]) * expm1_over(rise(out.log_d, k));
    }
    out.before[kX.size() - 1] = sum;
    out.total = sum + exp(out.log_d[kX.size() - 1] - T(kX[kX.size() - 1]));
    return out;
  }

  /// q - 1 for small slopes, seen from wo: xx x^2 + 2 xy x y + yy y^2, and the determinant's root. There
  /// s_z = (o_x x + o_y y) / n.o. A height that is added in squares to n.o stands for that of a wide lobe at grazing
  /// views. With w = 1 nothing limits the slopes across the plane of incidence; the lobe is a ring then, and its half
  /// vectors have slopes up to the view's. `level` is for that.
  struct Form {
    T xx, xy, yy, root;
  };
  Form form(const Vec3<T>& wo) const {
    const T z2 = sqr(maximum(wo.z, T(0))) + T(4) * (sqr(ax * wo.x) + sqr(ay * wo.y)) + T(1e-8),
            sides = sqr(wo.x) + sqr(wo.y);
    const T n = named("narrowing", narrowing(z2)), w = T(1) - heights;
    const T level = T(0.3) * heights * z2 / (z2 + sides), of_view = n * heights / (z2 * ax * ay);
    const T x = n * w / sqr(ax) + level, y = n * w / sqr(ay) + level;
    const T det = x * y + of_view * (sqr(wo.x) * y + sqr(wo.y) * x);
    return {named("form_xx", x + of_view * sqr(wo.x)), named("form_xy", of_view * wo.x * wo.y),
            named("form_yy", y + of_view * sqr(wo.y)), named("form_root", sqrt(det))};
  }

  /// The probability of sampling a half vector: the share of the highlight in what both would reflect towards wo.
  T highlight_share(const Vec3<T>& wo, const Slant& slant, const Form& form) const {
    const T z = maximum(wo.z, T(0));
    const Rgb<T> log_f = curve(logs(f), passed(kF, T(1) - z));
    // Both times a_x a_y and the form's root, by which a strong and narrow highlight would overflow if divided.
    const T highlight = slant.total * max_component(exp(log_f + Rgb<T>(log(strength + tiny<T>()))));
    const T matte = max_component(rho) * matte_at(z) * (ax * ay * form.root);
    return named("highlight_share", (T(1) - even_share()) * highlight / maximum(highlight + matte, tiny<T>()));
  }
  /// The probability of sampling all directions alike, larger where the lobe is a ring.
  T even_share() const {
    return T(0.2) * minimum(named("from_facets", abs(widening) + T(4) * heights), T(1)) +
           T(0.5) * clamp01(T(2) * heights - T(1));
  }

  /// The pdf of wi for a sampled half vector: p_h / (4 o.h), with p_h = p(s) / cos^3 theta_h and p(s) that of slopes.
  T highlight_pdf(const Vec3<T>& wi, const Vec3<T>& wo, const Slant& slant, const Form& form) const {
    const HalfVector<T> half(wi, wo);
    const Slopes<T> s(half.h);
    const T s2 = named("form_s2", maximum(form.xx * sqr(s.x) + T(2) * form.xy * s.x * s.y + form.yy * sqr(s.y), T(0)));
    const T q = T(1) + s2, inverse_cos2 = s.inverse_cos2();
    // x = ln q has the pdf e^E / total, and dx = d(s^2) / q, where pi d(s^2) / root is the area of slopes.
    const T pdf_x = exp(curve(slant.log_d, passed(kX, log1p(s2)))) / slant.total;
    return pdf_x * (sqrt(inverse_cos2) * form.root / q) * (inverse_cos2 / q) /
           (T(4) * pi<T>() * maximum(half.oh, tiny<T>()));
  }

  T pdf_of(const Vec3<T>& wi, const Vec3<T>& wo, const Slant& s, const Form& form) const {
    const T share = highlight_share(wo, s, form), even = even_share();
    const T others = T(kInvPi) * (even / T(2) + maximum(T(1) - share - even, T(0)) * wi.z);
    return select(above(wi, wo), share * highlight_pdf(wi, wo, s, form) + others, T(0));
  }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return pdf_of(wi, wo, slant(), form(wo)); }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Slant s = slant();
    const Form m = form(wo);
    const T share = highlight_share(wo, s, m);
    const auto highlight = u.x < share;
    const auto even = u.x < share + even_share();
    // In the last piece that begins below it: the integral from its first knot is `rest`.
    const T target = u.y * s.total;
    const std::size_t last = kX.size() - 1;
    T x(0);
    for (std::size_t k = 0; k < last; ++k) {
      const T r = rise(s.log_d, k), width(kX[k + 1] - kX[k]);
      const T height = exp(s.log_d[k] - T(kX[k])) * width;
      const T rest = maximum(target - s.before[k], T(0)) / maximum(height, tiny<T>());
      const auto flat = abs(r) < T(1e-4);
      const T curved = log1p(maximum(rest * r, T(-1) + T(1e-7))) / select(flat, T(1), r);
      const T part = clamp01(select(flat, rest, curved));
      x = select(target >= s.before[k], T(kX[k]) + width * part, x);
    }
    // Beyond the last knot, e^(E) falls as e^(-x).
    const T above_it = maximum((s.total - target) / maximum(s.total - s.before[last], tiny<T>()), T(1e-12));
    x = named("x", select(target >= s.before[last], T(kX[last]) - log(minimum(above_it, T(1))), x));
    // Slopes on the ellipse where the form is `slope` squared.
    const T slope = sqrt(expm1(x)), phi = T(2) * pi<T>() * u.z, root_yy = sqrt(m.yy);
    const T along = slope * cos(phi) / m.root;
    const T sx = named("sx", along * root_yy), sy = named("sy", (slope * sin(phi) - along * m.xy) / root_yy);
    const T cos_h = T(1) / sqrt(T(1) + sx * sx + sy * sy);
    const Vec3<T> h = {sx * cos_h, sy * cos_h, cos_h};
    const T sine = sqrt(maximum(T(1) - u.y * u.y, T(0)));
    const Vec3<T> evenly = {sine * cos(phi), sine * sin(phi), u.y};
    const Vec3<T> other = select(even, evenly, sample_cosine(u.y, u.z));
    const Vec3<T> wi = select(highlight, h * (T(2) * dot(wo, h)) - wo, other);
    const T p = pdf_of(wi, wo, s, m);
    return sample_if(above(wi, wo) && p > T(0), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
  }

  /// (n.i) (n.o) over Smith's correlated shadowing of GGX facets, for heights of light and view. `p2` is the square of
  /// the roughness times the sine.
  static T inverse_smith(const T& zi, const T& zo, const T& p2) {
    // (n.w) Lambda.
    const auto hidden = [&](const T& z) { return p2 / (T(2) * maximum(sqrt(z * z + p2) + z, tiny<T>())); };
    return zi * zo + zo * hidden(zi) + zi * hidden(zo);
  }

  /// GGX facets and the matte part. The facets' weight is that of the curves over those of Cycles' facets, which have
  /// d = F = 1 and Smith's correlated shadowing, at a frequent slope and where the lobe is at its mean height. They
  /// fade where the lobe is not one of facets: stretched as form() is, they lacked half of fitted lobes about the
  /// mirror direction.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T zo = maximum(wo.z, T(0)), p2 = sqr(ax * wo.x) + sqr(ay * wo.y);
    const T facets_share = named("facets_share", clamp01(T(1) - abs(widening) - T(4) * heights));
    const T zi = lobe_height(zo, T(0.7) * p2);
    const Rgb<T> weight = product(T(kLn2), T(1) - zi, log_visibility(zi) + log_visibility(zo)) *
                          (T(0.92) * inverse_smith(zi, zo, p2) / (least_height(zi) * least_height(zo)) * facets_share);
    Closure<T> matte(ClosureKind::Diffuse, rho * (matte_at(zo) * (T(1) - rim / T(6))));
    return {facets(ClosureKind::Ggx, weight, ax, ay, T(0)), matte};
  }

  /// Two lobes of isotropic GGX facets and the matte part, for EEVEE. Together the lobes have the light, and the mean,
  /// variance and skewness of the logarithm of slopes of D, unless D is narrower than GGX. Where the lobe widens
  /// towards grazing views, so do they. Fresnel term and shadowing are taken at the mean heights of light and view.
  ///
  /// Light that is misplaced, for 26 of MERL's materials as others describe them: median 11 %, nine tenths below 21 %,
  /// worst 55 % (the blue of a red paint, which has another width). A lobe about the mirror direction is round, those
  /// of facets are not: 48 % for Phong's. A lobe that surrounds the normal as a ring, or cloth, has no such closures.
  ClosureSum<T> stand_in(const Vec3<T>& wo) const {
    Rgb<T> light(T(0)), here = d[0];
    std::array<T, 4> moment = {T(0), T(0), T(0), T(0)};
    for (std::size_t k = 0; k < kD.size(); ++k) {
      // Slopes that reflect light from above to the side count little: d goes on from the knots before them.
      if (k > 0) here = here + (d[k] - here) / sqr(T(1) + T(5) * ax * ay * T(std::expm1(kD[k])));
      const T brightest = max_component(here);
      light += here * T(slope_moments()[k][0]);
      for (std::size_t i = 0; i < 4; ++i) moment[i] = moment[i] + brightest * T(slope_moments()[k][i]);
    }
    const T all = maximum(moment[0], tiny<T>());
    const T mean = named("mean_y", moment[1] / all);
    const T square = moment[2] / all, variance = square - sqr(mean);
    const T skew = moment[3] / all - T(3) * mean * square + T(2) * mean * sqr(mean);
    // Two logistic distributions at a distance, with the shares p(1 - p) = 1 / (4 + s^2): their variance exceeds that
    // of one by p(1 - p) distance^2, and their skewness is s in units of that excess.
    const T excess = named("excess", maximum(variance - T(kSpreadOfGgx), T(1e-4)));
    const T s = minimum(maximum(skew / (excess * sqrt(excess)), T(-3)), T(3));
    const T distance = sqrt(excess * (T(4) + sqr(s)));
    const T wide = named("wide_share", T(0.5) - T(0.5) * s / sqrt(T(4) + sqr(s)));

    // As form(), as far as one roughness can follow. The square of the mean height, as of a lobe about the mirror
    // direction: the light is higher by the root of the lobe's width where the view is in the surface.
    const T zo = maximum(wo.z, T(0)), sides = T(1) - sqr(zo), a = sqrt(ax * ay), w = T(1) - heights;
    const T z2 = named("z2", sqr(zo) + minimum(a * exp(mean / T(2)), T(1)) * sides);
    const T n = narrowing(z2), level = T(0.3) * heights * z2 / (z2 + sides);
    const T area = named("area", T(1) / sqrt((n * (w + heights * sides / z2) + level) * (n * w + level)));
    const auto alpha = [&](const T& y) { return minimum(maximum(a * exp(y / T(2)) * sqrt(area), T(1e-3)), T(1)); };
    const T p2 = sqr(alpha(mean)) * sides;
    const T zi = minimum(lobe_height(zo, T(0.5) * p2), T(1)), cosTheta_d = minimum(lobe_height(zo, p2), T(1));
    const Rgb<T> log_f = curve(logs(f), passed(kF, T(1) - cosTheta_d));
    const T log_visible = log_visibility(zi) + log_visibility(zo) + log(strength + tiny<T>());
    const Rgb<T> weight = exp(log(light + Rgb<T>(tiny<T>())) + log_f + Rgb<T>(log_visible)) *
                          (inverse_smith(zi, zo, p2) * area / (least_height(zi) * least_height(zo)));
    const auto lobe = [&](const T& share, const T& y) { return facets(ClosureKind::Ggx, weight * share, alpha(y)); };
    return {lobe(T(1) - wide, mean - wide * distance), lobe(wide, mean + (T(1) - wide) * distance),
            Closure<T>(ClosureKind::Diffuse, rho * (matte_at(zo) * (T(1) - rim / T(6))))};
  }
};

BRDFC_MODEL(Factors)
BRDFC_STAND_IN(Factors)

}  // namespace brdfc
