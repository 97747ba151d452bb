// SPDX-License-Identifier: GPL-3.0-or-later
// Ashikhmin and Shirley's anisotropic Phong model.
//
// M. Ashikhmin, P. Shirley: An Anisotropic Phong Light Reflection Model, 2000. Equations below are the paper's.
// Specular eq. 16 with Schlick's Fresnel term eq. 11, diffuse eq. 14, their sum eq. 15, sampling eqs. 19, 20.
//
// Erratum: eq. 18 is printed upside down; p(k2) = p_h(h) / (4 (k1.h)).
//
// Stable forms. The exponent (n_u (h.u)^2 + n_v (h.v)^2) / (1 - (h.n)^2) is 0/0 at h = n. With
// s2 = (h.u)^2 + (h.v)^2 = 1 - (h.n)^2 the power is exp((n_u (h.u)^2 + n_v (h.v)^2) log(h.n) / s2), and
// log(h.n) = log1p(-s2) / 2 keeps its digits however small s2 is. cos theta = (1 - xi)^(1/(e+1)) is taken
// as 1 - cos theta = -expm1(log1p(-xi) / (e+1)) for the same reason. The tangent of eq. 19, infinite at
// xi_1 = 1, is kept as a ratio of sine and cosine; over the full circle that is the paper's map of four quadrants.
#include "model/half_vector.h"

namespace brdfc {

template <class T> struct AshikhminShirley {
  Rgb<T> rs, rd;
  T nu, nv, rotation;
  Choice part, diffuse;

  enum { Both, Specular, Diffuse };

  static ModelInfo info() {
    return {
        .name = "ashikhmin_shirley",
        .label = "Ashikhmin-Shirley",
        .paper = "M. Ashikhmin, P. Shirley: An Anisotropic Phong Light Reflection Model, 2000",
        .equations = "eqs. 11, 14-16, 19, 20; eq. 18 inverted",
        .doc = "Anisotropic Phong lobe with Fresnel reflection over a diffuse base that gives way at grazing angles.",
        .properties = {.isotropic = false,
                       .smooth = false,  // max(wi.z, wo.z) of eq. 16
                       .exact_sampling = false,
                       .specular_limit = "part=specular nu=1e8 nv=1e8"},
        .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(rs, ColorSpec{"rs", "Specular Reflectance", {0.05, 0.05, 0.05}, "Mirror reflectance at normal incidence, R_s"});
    v(rd, ColorSpec{"rd", "Diffuse Reflectance", {0.5, 0.5, 0.5}, "Albedo of the diffuse substrate, R_d"});
    v(nu, NumberSpec{"nu", "Exponent U", 100, 0, 1e8, 0, 10000, "Phong exponent along the tangent, n_u"});
    v(nv, NumberSpec{"nv", "Exponent V", 100, 0, 1e8, 0, 10000, "Phong exponent across the tangent, n_v"});
    v(rotation,
      NumberSpec{"rotation", "Rotation", 0, -2 * kPi, 2 * kPi, -kPi, kPi, "Turns the tangent about the normal", "rad"});
    v(part, ChoiceSpec{"part", "Part", {"both", "specular", "diffuse"}, "Which terms of eq. 15 to use"});
    v(diffuse, ChoiceSpec{"diffuse", "Diffuse Term", {"paper"}, "paper: eq. 14"});
  }

  /// The half vector in the turned frame.
  HalfVector<T> half(const Vec3<T>& wi, const Vec3<T>& wo) const {
    HalfVector<T> k(wi, wo);
    k.h = rotate_z(k.h, cos(rotation), sin(rotation));
    return k;
  }

  /// p_h(h), eq. 5.
  T p_h(const Vec3<T>& h) const {
    const T hu2 = h.x * h.x, hv2 = h.y * h.y;
    const T s2 = named("sin2_h", hu2 + hv2);
    // log(h.n) / (1 - (h.n)^2): near the pole from s2, near the horizon from h.n itself.
    const T near_pole = select(s2 < T(1e-12), T(-0.5), T(0.5) * log1p(-minimum(s2, T(0.75))) / maximum(s2, T(1e-12)));
    const T near_horizon = log(maximum(h.z, tiny<T>())) / maximum(s2, T(0.25));
    const T log_ratio = named("log_ratio", select(s2 < T(0.5), near_pole, near_horizon));
    return named("p_h", sqrt((nu + T(1)) * (nv + T(1))) / (T(2) * pi<T>()) * exp((nu * hu2 + nv * hv2) * log_ratio));
  }

  /// F(k.h), eq. 11.
  Rgb<T> fresnel(const HalfVector<T>& k) const {
    return named("F", rs + (Rgb<T>(T(1)) - rs) * named("one_minus_kh5", pow5(k.one_minus_oh)));
  }

  /// Specular term, eq. 16.
  Rgb<T> specular(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k = half(wi, wo);
    return fresnel(k) * (p_h(k.h) / (T(4) * k.oh * maximum(wi.z, wo.z)));
  }

  T specular_pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const HalfVector<T> k = half(wi, wo);
    return p_h(k.h) / (T(4) * k.oh);
  }

  /// Diffuse term, eq. 14.
  Rgb<T> substrate(const Vec3<T>& wi, const Vec3<T>& wo) const {
    // 1 - (1 - c/2)^5 as a polynomial: no cancellation for small c.
    const auto fade = [](const T& c) {
      const T x = c / T(2);
      return x * (T(5) - x * (T(10) - x * (T(10) - x * (T(5) - x))));
    };
    return rd * (Rgb<T>(T(1)) - rs) * (T(28) / (T(23) * pi<T>()) * fade(wi.z) * fade(wo.z));
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    Rgb<T> f(T(0));
    if (part != Diffuse) f += specular(wi, wo);
    if (part != Specular) f += substrate(wi, wo);
    return select(above(wi, wo), f, Rgb<T>(T(0)));
  }

  /// How often sample() takes the specular lobe.
  T specular_share() const { return part == Specular ? T(1) : part == Diffuse ? T(0) : T(0.5); }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T share = specular_share();
    T p(0);
    if (part != Diffuse) p = p + share * specular_pdf(wi, wo);
    if (part != Specular) p = p + (T(1) - share) * cosine_pdf(wi);
    return select(above(wi, wo), p, T(0));
  }

  /// Half vector with density p_h, eqs. 19 and 20, reflected to a direction by eq. 17.
  Vec3<T> sample_specular(const Vec3<T>& wo, const T& u1, const T& u2) const {
    const T angle = T(2) * pi<T>() * u1;
    const T cu = sqrt(nv + T(1)) * cos(angle), cv = sqrt(nu + T(1)) * sin(angle);
    const T norm = sqrt(cu * cu + cv * cv);
    const T cosPhi = named("cosPhi", cu / norm), sinPhi = named("sinPhi", cv / norm);
    const T exponent = nu * cosPhi * cosPhi + nv * sinPhi * sinPhi;
    const T one_minus_cos = named("one_minus_cos_h", -expm1(log1p(-u2) / (exponent + T(1))));
    const T sinTheta = named("sinTheta_h", sqrt(one_minus_cos * (T(2) - one_minus_cos)));
    const Vec3<T> h =
        rotate_z(Vec3<T>{sinTheta * cosPhi, sinTheta * sinPhi, T(1) - one_minus_cos}, cos(rotation), -sin(rotation));
    return h * (T(2) * dot(wo, h)) - wo;
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    if (part == Diffuse) {
      const Vec3<T> wi = sample_cosine(u.y, u.z);
      const T p = cosine_pdf(wi);
      return sample_if(above(wi, wo), wi, substrate(wi, wo) * pi<T>(), p);
    }
    if (part == Specular) {
      // f cos / pdf leaves F min(1, cos_i / cos_o): the power cancels.
      const Vec3<T> wi = sample_specular(wo, u.y, u.z);
      const HalfVector<T> k = half(wi, wo);
      const T ratio = wi.z / maximum(maximum(wi.z, wo.z), tiny<T>());
      return sample_if(above(wi, wo), wi, fresnel(k) * ratio, p_h(k.h) / (T(4) * k.oh));
    }
    const auto specular_lobe = u.x < specular_share();
    const Vec3<T> glossy = sample_specular(wo, u.y, u.z), matte = sample_cosine(u.y, u.z);
    const Vec3<T> wi = select(specular_lobe, glossy, matte);
    const T p = pdf(wi, wo);
    return sample_if(p > T(0), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
  }
};

BRDFC_MODEL(AshikhminShirley)

}  // namespace brdfc
