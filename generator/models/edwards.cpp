// SPDX-License-Identifier: GPL-3.0-or-later
// A lossless lobe about the mirror direction on the halfway vector disk of Edwards et al.
//
// D. Edwards, S. Boulos, J. Johnson, P. Shirley, M. Ashikhmin, M. Stark, C. Wyman: The Halfway Vector Disk for BRDF
// Modeling, ACM Transactions on Graphics 25(1), 2006.
//
// The disk. Let (x, y) be the slopes of the half vector h, its horizontal part over n.h. For a view o, the points
// u = (n.o) (x, y) - (o_x, o_y) of all directions i above the surface fill the unit disk, and 1 - |u|^2 =
// (n.i) (n.o) / (n.h)^2. With any density p on that disk
//   f (n.i) = rho p(u) (n.o)^2 / (4 (n.h)^3 (o.h))
// is rho times a pdf of i, so that for rho = 1 every view sees all light. The paper leaves p open.
//
// The density. A lump (e + 1) / pi (1 - |m|^2)^e about the disk's centre m = 0 is that of BRDF Explorer's
// edwards06.brdf. There it stands about the point of the mirror direction, u = -(o_x, o_y), so that at oblique views
// part of it is outside the disk, and light is lost. Here an automorphism of the disk moves its centre to that point.
// With complex numbers s = x + i y and o = o_x + i o_y,
//   m = (u + o) / (1 + conj(o) u) = s / (n.o + conj(o) s),  1 - |m|^2 = (n.i) (n.o) / K,
//   K = (o.h)^2 + (o_x h_y - o_y h_x)^2,
// and with the automorphism's Jacobian (n.h)^4 / K^2
//   f = rho (e + 1) / (4 pi) ((n.i) (n.o) / K)^(e - 1) (n.o)^3 (n.h) / (K^3 (o.h)).
// At normal incidence this is BRDF Explorer's formula with R = 1. Towards grazing views the slopes of the lobe fall as
// n.o, as mirror images on rough surfaces do. e >= 1 keeps f finite at the horizon.
//
// f is not reciprocal: the density is one of i for each o, not the reverse. From a lamp's side the light that leaves
// over that which arrives is 0.78 at normal incidence and 1.31 at a cosine of 0.15 for e = 20; 0.94 and, at 0.3, 1.05
// for e = 100; 0.27 and 5.0 for e = 1 (tests/models/edwards_test.cpp).
#include "model/base_terms.h"
#include "model/half_vector.h"
#include "model/sampling.h"
#include "model/under.h"

namespace brdfc {

template <class T> struct Edwards {
  Rgb<T> rho;
  T e;

  static ModelInfo info() {
    return {.name = "edwards",
            .label = "Edwards",
            .look = Look::Metal,
            .paper =
                "D. Edwards, S. Boulos, J. Johnson, P. Shirley, M. Ashikhmin, M. Stark, C. Wyman: The Halfway Vector "
                "Disk for BRDF Modeling, ACM Transactions on Graphics 25(1), 2006",
            .equations = "f = rho p (n.o)^2 / (4 (n.i) (n.h)^3 (o.h)) with a density p of our own",
            .doc = "Metallic lobe that reflects all light at every view and becomes sharper at grazing angles.",
            .properties = {.reciprocal = false, .lossless = true, .specular_limit = "e=1e8"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rho, ColorSpec{"rho", "Reflectance", {0.5, 0.5, 0.5}, "Share of the light that is reflected"}.as(
               Optical::Reflectance));
    v(e, NumberSpec{"e", "Exponent", 20, 1, 1e8, 1, 1000, "Exponent of the lump on the disk: larger is narrower"}
             .by_factors());
  }

  /// f / rho.
  T lobe(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k(wi, wo);
    const T side = named("side", wo.x * k.h.y - wo.y * k.h.x);
    // f grows as (n.o)^-4; without a limit it overflows in single precision within 3e-8 of the horizon.
    const T K = named("K", maximum(sqr(k.oh) + sqr(side), T(1e-15)));
    // |m|^2 and 1 - |m|^2. Each is the exact one where it is small.
    const T m2 = named("m2", sin2_theta(k.h) / K), rest = named("rest", wi.z * wo.z / K);
    const T near_mirror = log1p(-minimum(m2, T(0.5))), near_horizon = log(maximum(rest, tiny<T>()));
    const T lump = named("lump", exp((e - T(1)) * select(m2 < T(0.5), near_mirror, near_horizon)));
    const T r = named("r", wo.z / K);
    return select(above(wi, wo),
                  (e + T(1)) / (T(4) * pi<T>()) * lump * sqr(r) * (wo.z * k.h.z / (K * maximum(k.oh, T(3e-8)))), T(0));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return rho * lobe(wi, wo); }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return lobe(wi, wo) * wi.z; }

  /// Draws m from the lump. Then s = (n.o) m / (1 - conj(o) m).
  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T radius = named("radius", sqrt(-expm1(log1p(-u.y) / (e + T(1))))), phi = T(2) * pi<T>() * u.z;
    const T mx = radius * cos(phi), my = radius * sin(phi);
    const T re = named("re", T(1) - (wo.x * mx + wo.y * my)), im = named("im", wo.y * mx - wo.x * my);
    const T scale = named("scale", wo.z / maximum(re * re + im * im, tiny<T>()));
    const T x = named("slope_x", scale * (mx * re + my * im)), y = named("slope_y", scale * (my * re - mx * im));
    const T twice = named("twice", T(2) * (wo.x * x + wo.y * y + wo.z) / (T(1) + x * x + y * y));
    const Vec3<T> wi = {twice * x - wo.x, twice * y - wo.y, twice - wo.z};
    return sample_if(above(wi, wo), wi, rho, pdf(wi, wo));
  }

  /// Near the mirror direction |m|^2 is |s|^2 / (n.o)^2, so the lobe is that of facets whose slope is (n.o) / sqrt(e +
  /// 1). In the plane of incidence it is |s|^2 / (n.o - |s| sin theta_o)^2 on the viewer's side and falls faster there,
  /// so the slope is less by the factor `in_plane`. `across` is that of the slope across the plane.
  Closure<T> facets_of(const Rgb<T>& weight, const Vec3<T>& wo, const T& in_plane, const T& across) const {
    const T slope = named("slope", wo.z / sqrt(e + T(1)));
    Closure<T> c(ClosureKind::Beckmann, weight);
    c.alpha = facet_alpha(slope * in_plane);
    c.alpha_across = facet_alpha(slope * across);
    c.tangent = mirror_side(wo);
    c.stretched = Tangent::View;
    return c;
  }
  T tilt(const Vec3<T>& wo) const { return named("tilt", sqrt(sin2_theta(wo) / (e + T(1)))); }

  ClosureSum<T> base(const Vec3<T>& wo) const {
    const T t = tilt(wo), in_plane = T(1) / sqrt(T(1) + T(4) * t * t);
    return {facets_of(rho * (in_plane / (T(1) + T(0.4) * t)), wo, in_plane, T(1))};
  }

  /// The constants were found by bisection. Facets that Cycles would widen are none.
  ClosureSum<T> under(const Vec3<T>& wo) const {
    const T t = tilt(wo), narrow = T(3.4) / (e + T(1));
    const T x = T(1) / sqrt(T(1) + narrow + T(6) * t), y = T(1) / sqrt(T(1) + narrow);
    const T weight = select(wo.z * x > T(kLeastRoughness) * sqrt(e + T(1)), x * y / (T(1) + T(0.8) * t), T(0));
    return {facets_of(rho * weight, wo, x, y)};
  }
};

BRDFC_MODEL(Edwards)
BRDFC_UNDER(Edwards)

}  // namespace brdfc
