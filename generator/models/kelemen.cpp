// SPDX-License-Identifier: GPL-3.0-or-later
// Kelemen and Szirmay-Kalos's model: microfacets whose masking needs no min(), and below them a matte term that gets
// the light which these leave.
//
// C. Kelemen, L. Szirmay-Kalos: A Microfacet Based Coupled Specular-Matte BRDF Model with Importance Sampling,
// Eurographics 2001, short presentations. With the half vector's length |i + o| = 2 (o.h),
//   f = D F / |i + o|^2 + r_m (1 - a_i) (1 - a_o) / (pi (1 - a_mean)),
// eq. 3 and sec. 2.2, where a_i and a_o are the albedos of the first term for light from i and o, and a_mean is their
// cosine-weighted mean. D is Beckmann's distribution, so that D (n.h) integrates to 1, and F is Schlick's approximation
// with the reflectance f0 at normal incidence.
//
// Energy. For any D that is symmetric about the normal the first term gains no light. With the slopes x, y of the half
// vector and t = tan theta_o its albedo is the mean of max(0, w) F, w = 2 - (1 + x^2 + y^2) / (1 - x t). Where w is
// above 0 for both x and -x, their mean is at most 1 since 1 / (1 - x t) + 1 / (1 + x t) is at least 2; elsewhere one
// is 0 and the other below 2. For F = 1 the albedo is 1 at the horizon. 1 / (o.h)^2 is never above Torrance and
// Sparrow's G / ((n.i)(n.o)), so f is nowhere above that of cook_torrance.
//
// The albedo has no closed form; the paper tabulates it. Since F is linear in f0, 1 - a = L + (1 - f0) S, where L is
// what is lost for F = 1, and S the albedo for F = 1 - (1 - c)^5. Here, with
//   v = 1 / (1 + 2 m t),  s2 = sin^2 theta,  u = (n.w) / ((n.w) + m s2),  z = (1 + m) (n.w) / ((n.w) + m),
//   e = m^2 (1 - exp(-1 / m^2)), which is L at normal incidence, and
//   c = ((n.w) + exp(-y^2) (m sin theta - (n.w) / (y + sqrt(y^2 + 4 / pi))) / sqrt(pi)) / sqrt(1 + m^2),
//   y = (n.w) / (2 m sin theta), the mean of w (o.h) in narrow lobes but for an approximation of erfc,
//   L = v^0.85 (1 - v)^2 P(v, m) + e u sum_i d_i u^i,  S = (1 - (1 - c)^5) Q(z, m),
// where P and Q are polynomials, fitted from below to quadratures, so that no light is gained. With r_m = 1 the model
// loses 0.5 % of the light on average with f0 = 1 and 1.1 % with f0 = 0, and 2.1 % at most
// (tests/models/kelemen_test.cpp). The means are fitted from above.
//
// Sampling. The paper draws h from D and reflects. Here the visible normals of V-cavities are drawn (model/facets.h):
// the weights of the first term are then at most F, and no half of the samples is lost at grazing views. The matte term
// has Lambert's cosine. For f0 = 1 and m below 0.05 it gathers at the horizon, where few of these samples are: there
// the variance is high, of at most a fifth of the light, from grazing views.
#include "model/base_terms.h"
#include "model/facets.h"
#include "model/fresnel.h"
#include "model/under.h"

namespace brdfc {
namespace {

/// c_ij of L, of powers of 2 v - 1 and 2 m - 1; d_i; c_ij of S, of powers of 2 z - 1 and 2 m - 1.
constexpr std::array<std::array<double, 3>, 5> kNarrowLoss = {{{0.9405, 0.1647, -0.0597},
                                                               {-0.716, -0.3393, -0.4891},
                                                               {-0.4514, 0.4124, 0.5612},
                                                               {-0.119, 0.5486, 0.8408},
                                                               {0.7393, 0.2967, -0.0368}}};
constexpr std::array<double, 3> kWideLoss = {0.0929, 1.1378, -0.2484};
constexpr std::array<std::array<double, 4>, 4> kSoftness = {{{0.7353, -0.1328, 0.0581, -0.0509},
                                                             {-0.0977, -0.1302, 0.0148, 0.0032},
                                                             {0.0509, -0.1062, -0.045, 0.0944},
                                                             {0.0591, -0.0706, -0.0982, 0.0811}}};
/// The means: of L over m^2 (1 - log m), of powers of 2 cbrt(m) - 1, and of S, of powers of 2 sqrt(m) - 1.
constexpr std::array<double, 8> kMeanLoss = {0.777, -0.1358, -0.5334, 0.4383, 0.7772, -0.9694, -0.3448, 0.4958};
constexpr std::array<double, 6> kMeanSoftness = {0.8551, -0.2829, -0.2088, 0.0664, 0.0627, -0.0177};

template <class T, std::size_t N> T polynomial(const std::array<double, N>& c, const T& x) {
  T sum(c[N - 1]);
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * x + T(c[i]);
  return sum;
}
template <class T, std::size_t N, std::size_t M>
T polynomial(const std::array<std::array<double, M>, N>& c, const T& x, const T& y) {
  T sum = polynomial(c[N - 1], y);
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * x + polynomial(c[i], y);
  return sum;
}

}  // namespace

template <class T> struct Kelemen {
  Rgb<T> f0, rm;
  T m;

  static ModelInfo info() {
    return {.name = "kelemen",
            .label = "Kelemen",
            .look = Look::Glossy,
            .paper =
                "C. Kelemen, L. Szirmay-Kalos: A Microfacet Based Coupled Specular-Matte BRDF Model with Importance "
                "Sampling, Eurographics 2001",
            .equations = "eq. 3 with Beckmann's D and Schlick's F; the matte term of sec. 2.2 with a fitted albedo",
            .doc = "Plastic or glaze: microfacets over a matte base, which gets the light that the microfacets leave.",
            .properties = {.exact_sampling = false, .specular_limit = "rm=0 m=1e-4", .fit_axis = "m"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(f0, ColorSpec{"f0", "Normal Reflectance", {0.05, 0.05, 0.05}, "Reflectance of a facet seen from above"}
              .as(Optical::Reflectance)
              .at_most_one());
    v(rm, ColorSpec{"rm",
                    "Matte Reflectance",
                    {0.8, 0.8, 0.8},
                    "Share of the light left by the facets that the matte base reflects"});
    v(m, NumberSpec{"m", "Slope", 0.3, 1e-4, 1, 0.05, 1, "Root mean square slope of the facets, m"}.by_factors());
  }

  Facets<T> surface() const { return {m, m, true, true}; }
  Rgb<T> F(const T& one_minus_oh) const { return named("F", schlick_fresnel(f0, one_minus_oh)); }

  /// L at normal incidence.
  T e() const {
    const T m2 = m * m;
    return named("e", -m2 * expm1(T(-1) / m2));
  }

  /// 1 - a, what the facets leave of the light from w.
  Rgb<T> rest(const Vec3<T>& w) const {
    const T zw = maximum(w.z, tiny<T>()), s2 = sin2_theta(w), slope = named("slope", m * sqrt(s2));
    const T v = named("v", zw / (zw + T(2) * slope)), u = named("u", zw / (zw + m * s2));
    const T away = T(2) * slope / (zw + T(2) * slope);  // 1 - v
    const T L = pow(v, T(0.85)) * sqr(away) * polynomial(kNarrowLoss, T(2) * v - T(1), T(2) * m - T(1)) +
                e() * u * polynomial(kWideLoss, u);
    const T y = named("y", minimum(zw / maximum(T(2) * slope, tiny<T>()), T(30)));
    const T tail = exp(-y * y) * (slope - zw / (y + sqrt(y * y + T(4 * kInvPi)))) / sqrt(pi<T>());
    const T c = named("c", (zw + tail) / sqrt(T(1) + m * m));
    const T z = named("z", (T(1) + m) * zw / (zw + m));
    const T S = one_minus_schlick_weight(c) * polynomial(kSoftness, T(2) * z - T(1), T(2) * m - T(1));
    return Rgb<T>(named("L", L)) + (Rgb<T>(T(1)) - f0) * named("S", S);
  }
  /// 1 - a_mean
  Rgb<T> mean_rest() const {
    const T L = named("L_mean", m * m * (T(1) - log(m)) * polynomial(kMeanLoss, T(2) * cbrt(m) - T(1)));
    const T S = named("S_mean", polynomial(kMeanSoftness, T(2) * sqrt(m) - T(1)));
    return Rgb<T>(L) + (Rgb<T>(T(1)) - f0) * S;
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    const T facets = surface().D(k.h) / (T(4) * maximum(sqr(k.oh), tiny<T>()));
    const Rgb<T> matte = named("matte", rm * rest(wi) * rest(wo) / (mean_rest() * pi<T>()));
    return select(above(wi, wo), F(k.one_minus_oh) * facets + matte, Rgb<T>(T(0)));
  }

  /// The share of samples that are reflected by facets, after the albedos of both terms.
  T share(const Vec3<T>& wo) const {
    const Rgb<T> left = rest(wo);
    const T glossy = max_component(Rgb<T>(T(1.01)) - left), matte = max_component(rm * left);
    return named("share", glossy / (glossy + matte));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T s = share(wo);
    return select(above(wi, wo), s * surface().reflected_pdf(wi, wo) + (T(1) - s) * cosine_pdf(wi), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T s = share(wo);
    const auto is_facet = u.x < s;
    const Vec3<T> h = surface().sample_normal(wo, {minimum(u.x / maximum(s, tiny<T>()), T(1)), u.y, u.z}).h;
    const Vec3<T> wi = select(is_facet, h * (T(2) * dot(wo, h)) - wo, sample_cosine(u.y, u.z));
    const T p = pdf(wi, wo);
    return sample_if(above(wi, wo) && p > T(0), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
  }

  /// The same facets with Smith's masking, with the Fresnel term at the middle of the lobe, and the matte term as it is
  /// for smooth facets of low reflectance.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T height = lobe_height(wo.z, T(0.7) * m * m * sin2_theta(wo));
    Closure<T> matte(ClosureKind::DiffuseRamp, rm * rest(wo));
    for (int i = 0; i < kRampSize; ++i) {
      const T c(double(i) / (kRampSize - 1));
      matte.ramp[std::size_t(i)] = Rgb<T>(T(1.05) * one_minus_schlick_weight(c) * c);
    }
    return {facets(ClosureKind::Beckmann, F(clamp01(T(1) - height)), m), matte};
  }

  /// For any m, S cos theta over its value 1 - e at normal incidence is above these two cones. Of the facets, those of
  /// cook_torrance.cpp: they exceed this f by less than 1e-4 of its light, too.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T narrow = narrow_towards_horizon(m, wo);
    const Rgb<T> soft = (Rgb<T>(T(1)) - f0) * ((T(1) - e()) / pi<T>());
    ClosureSum<T> sum = cones_under(rm * rest(wo) * soft / mean_rest(), {0.97, 0.69}, {0.46, 0.95});
    sum.push_back(narrower_facets(f0, m, m, narrow, narrow));
    return sum;
  }
};

BRDFC_MODEL(Kelemen)
BRDFC_UNDER(Kelemen)

}  // namespace brdfc
