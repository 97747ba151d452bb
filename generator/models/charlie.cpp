// SPDX-License-Identifier: GPL-3.0-or-later
// The Charlie sheen: fibres that stand off a cloth, as microfacets whose normals lie along the surface.
//
// A. Estevez, C. Kulla: Production Friendly Microfacet Sheen BRDF, Sony Pictures Imageworks, 2017:
//   f = D G / (4 (n.i)(n.o)),  D = (2 + 1/r) sin^(1/r) theta_h / (2 pi),  G = 1 / (1 + Lambda_i + Lambda_o),
//   Lambda(c) = exp(L(c)) for c < 1/2, exp(2 L(1/2) - L(1 - c)) above;  L(x) = a / (1 + b x^c) + d x + e.
// The five constants are (1 - r)^2 times those fitted for r = 0 plus the rest times those for r = 1. The softer
// terminator raises Lambda_i to the power 1 + 2 (1 - (n.i))^8, which makes f not reciprocal. There is no Fresnel term;
// the colour is a factor.
//
// D is normalised, D (n.h) integrates to 1. G is a fit, so light is conserved only for the roughnesses accepted here:
// the albedo near the horizon is 0.90 for r = 0.1 and 0.94 for r = 1, but 1.10 for r = 0.05. In renderers the sheen
// lies over another layer, which a table of its albedo dims; here it is alone.
//
// Numerical stability. sin^2 theta_h is the sum of squares of the half vector's other components. Near the horizon
// Lambda reaches e^20 (e^60 with the softer terminator); the quotient of G and the cosines is 1 / (4 (n.i)(n.o) (1 +
// Lambda_i + Lambda_o)), in which no factor overflows.
//
// Sampling. The paper recommends uniform directions. But the half vector is level only if light goes back to where it
// came from, so here the density is a power of 1.2 + x, where x is the component of wi along the surface and towards
// the viewer. For r = 0.3 seen at 45 degrees this lowers the variance from 0.61 to 0.22 of the squared albedo; for a
// view from above the power is 0.
//
// There is no base. One of Cycles' upright fibres and a ramp, 20 to 25 % off, made aimed forms noisier: 4 instead
// of 2.9 times the Glossy node's variance under an area lamp, 14 instead of 9.1 under a smooth sky without a floor.
#include "model/half_vector.h"

namespace brdfc {

template <class T> struct Charlie {
  Rgb<T> tint;
  T r;
  Choice terminator;

  enum { Plain, Soft };

  static ModelInfo info() {
    return {.name = "charlie",
            .label = "Charlie Sheen",
            .look = Look::Matte,
            .paper = "A. Estevez, C. Kulla: Production Friendly Microfacet Sheen BRDF, Sony Pictures Imageworks, 2017",
            .equations = "f = D G / (4 (n.i)(n.o)), D of eq. 2, Lambda of eqs. 3 and 4",
            .doc = "Sheen of cloth: dark from above and bright at the rim, where light passes along the fibres.",
            .properties = {.reciprocal = false,  // with the softer terminator
                           .exact_sampling = false},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(tint, ColorSpec{"tint", "Color", {0.8, 0.8, 0.8}, "Factor of all that is reflected"});
    v(r, NumberSpec{"r", "Roughness", 0.3, 0.1, 1, 0.1, 1, "Small values narrow the sheen to the rim"}.by_factors());
    v(terminator, ChoiceSpec{"terminator",
                             "Terminator",
                             {"plain", "soft"},
                             "soft: light fades gradually where it grazes the surface; not reciprocal"});
  }

  T L(const T& x) const {
    const T w = sqr(T(1) - r);
    const auto of = [&](double at_0, double at_1) { return T(at_1) + T(at_0 - at_1) * w; };
    return of(25.3245, 21.5473) / (T(1) + of(3.32435, 3.82987) * pow(maximum(x, tiny<T>()), of(0.16801, 0.19823))) +
           of(-1.27393, -1.97760) * x + of(-4.85967, -4.32054);
  }
  /// `rise` is 1 - c, without cancellation: L is steep at 0.
  T log_lambda(const T& c, const T& rise) const {
    const T low = L(minimum(c, rise));
    return named("log_lambda", select(c < T(0.5), low, T(2) * L(T(0.5)) - low));
  }
  T rise(const Vec3<T>& w) const { return sin2_theta(w) / (T(1) + clamp01(w.z)); }

  /// 1 / (4 (n.i)(n.o) (1 + Lambda_i + Lambda_o)).
  T shape(const T& cosTheta_i, const T& rise_i, const T& cosTheta_o, const T& rise_o) const {
    const T zi = clamp01(cosTheta_i), zo = clamp01(cosTheta_o);
    T li = log_lambda(zi, rise_i);
    if (terminator == Soft) li = li * (T(1) + T(2) * sqr(sqr(sqr(T(1) - zi))));
    return T(1) / (T(4) * maximum(zi * zo * (T(1) + exp(li) + exp(log_lambda(zo, rise_o))), tiny<T>()));
  }
  T D(const T& sin2) const {
    return named("D", (T(2) + T(1) / r) * pow(maximum(sin2, tiny<T>()), T(1) / (T(2) * r)) / (T(2) * pi<T>()));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    return tint * select(above(wi, wo), D(sqr(k.h.x) + sqr(k.h.y)) * shape(wi.z, rise(wi), wo.z, rise(wo)), T(0));
  }

  /// How often the lobe that is sampled has its factor.
  T times(const Vec3<T>& wo) const {
    const T steep = T(0.5) - r / T(4) + T(0.4) * clamp01(wo.z) / r;
    return named("times", sqrt(sin2_theta(wo)) * steep);
  }
  /// Of the lobe's factor for light from the front and from behind.
  static constexpr double kMost = 2.2, kLeast = 0.2;

  /// `x` is the component of wi along the horizontal direction to the viewer.
  T density(const T& x, const Vec3<T>& wo) const {
    const T m = times(wo) + T(1);
    return m / (pi<T>() * (pow(T(kMost), m) - pow(T(kLeast), m))) * pow(x + T(kMost - 1), m - T(1));
  }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T x = (wi.x * wo.x + wi.y * wo.y) / sqrt(maximum(sin2_theta(wo), tiny<T>()));
    return select(above(wi, wo), density(x, wo), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T m = times(wo) + T(1), sin2 = sin2_theta(wo), least = pow(T(kLeast), m);
    const T x = pow(least + u.y * (pow(T(kMost), m) - least), T(1) / m) - T(kMost - 1);
    const T across = sqrt(maximum((T(1) - x) * (T(1) + x), T(0))), psi = pi<T>() * u.z;
    const T y = across * cos(psi), s = sqrt(maximum(sin2, tiny<T>()));
    const T cosPhi = select(sin2 > tiny<T>(), wo.x / s, T(1)), sinPhi = select(sin2 > tiny<T>(), wo.y / s, T(0));
    const Vec3<T> wi = {x * cosPhi - y * sinPhi, x * sinPhi + y * cosPhi, across * sin(psi)};
    const T p = pdf(wi, wo);
    return sample_if(above(wi, wo), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
  }
};

BRDFC_MODEL(Charlie)

}  // namespace brdfc
