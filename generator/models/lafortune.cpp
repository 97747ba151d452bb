// SPDX-License-Identifier: GPL-3.0-or-later
// Lafortune's generalised cosine lobe, isotropic: a Phong lobe about the mirrored view direction with scaled
// components.
//
// E. Lafortune, S. Foo, K. Torrance, D. Greenberg: Non-Linear Approximation of Reflectance Functions, SIGGRAPH 1997.
// f = k_s (e + 2) / (2 pi) [C_xy (i_x o_x + i_y o_y) + C_z i_z o_z]^e; 0 where the bracket is negative.
//
// C_xy = -1, C_z = 1 is the modified Phong model; C_xy = 1 is retroreflective; |C_xy| > C_z is off-specular; C_xy = 0
// is a lobe about the normal. In the paper the magnitude of the C also scales f. Here f is scaled by
// k_s (e + 2) / (2 pi), and the C are at most 1, so that no parameters gain energy.
//
// Numerical stability. The bracket is |w| cos with w = (C_xy o_x, C_xy o_y, C_z o_z). |w|^e is computed as
// exp(e log1p(|w|^2 - 1) / 2), where 1 - |w|^2 = (1 - C_xy^2) sin^2 theta_o + (1 - C_z^2) cos^2 theta_o is a sum of
// positive terms.
#include "model/base_terms.h"
#include "model/power_lobe.h"
#include "model/sampling.h"

namespace brdfc {

template <class T> struct Lafortune {
  T cxy, cz, e;
  Rgb<T> ks;

  static ModelInfo info() {
    return {.name = "lafortune",
            .label = "Lafortune",
            .look = Look::Special,
            .paper =
                "E. Lafortune, S. Foo, K. Torrance, D. Greenberg: Non-Linear Approximation of Reflectance Functions, "
                "SIGGRAPH 1997",
            .equations = "f = k_s (e + 2) / (2 pi) [C_xy (i_x o_x + i_y o_y) + C_z i_z o_z]^e",
            .doc = "Cosine lobe that may point off the mirror direction or back to the light.",
            .properties = {.positive = false,  // black where the bracket is negative
                           .smooth = false,    // with e <= 1 the rim of the lobe is an edge
                           .exact_sampling = false,
                           .diffuse_limit = "cxy=0 cz=1 e=0",
                           .fit_axis = "e"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(cxy,
      NumberSpec{"cxy", "Horizontal", -1, -1, 1, -1, 1, "C_xy: -1 mirrors, 1 returns the light, 0 ignores azimuths"});
    v(cz, NumberSpec{"cz", "Vertical", 0.8, 0, 1, 0, 1, "C_z: smaller than |C_xy| bends the lobe towards the horizon"});
    v(e, NumberSpec{"e", "Exponent", 10, 0, 300, 1, 100, "Exponent of the lobe: larger is narrower"}.by_factors());
    v(ks,
      ColorSpec{
          "ks", "Specular", {0.5, 0.5, 0.5}, "Share of the light that is reflected, seen from above, with C_z = 1"}
          .as(Optical::Reflectance));
  }

  /// The axis of the lobe, and |w|^e.
  struct Lobe {
    Vec3<T> axis;
    T scale;
  };
  Lobe lobe(const Vec3<T>& wo) const {
    const T cos_o = maximum(wo.z, T(0));
    const Vec3<T> w = {cxy * wo.x, cxy * wo.y, cz * cos_o};
    // Scaled by the largest component, so that no square underflows. Below 1e-30, w has no direction and f is 0.
    const T size = named("size", maximum(maximum(abs(w.x), abs(w.y)), w.z));
    const auto defined = size > tiny<T>();
    const Vec3<T> scaled = w / maximum(size, tiny<T>());
    const T len = named("len", sqrt(maximum(dot(scaled, scaled), T(1))));
    const T defect = (T(1) - cxy) * (T(1) + cxy) * sin2_theta(wo) + (T(1) - cz) * (T(1) + cz) * (cos_o * cos_o);
    const T log_len =
        select(defect < T(0.5), T(0.5) * log1p(-minimum(defect, T(0.75))), log(maximum(size, tiny<T>())) + log(len));
    return {{scaled.x / len, scaled.y / len, select(defined, scaled.z / len, T(1))},
            named("scale", select(defined, exp(e * log_len), T(0)))};
  }

  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const Lobe l = lobe(wo);
    return ks * select(above(wi, wo), (e + T(2)) / (T(2) * pi<T>()) * l.scale * power_lobe(e, wi, l.axis), T(0));
  }

  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
    return select(above(wi, wo), power_lobe_pdf(e, wi, lobe(wo).axis), T(0));
  }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const Lobe l = lobe(wo);
    const Vec3<T> wi = about_axis(l.axis, sample_power_lobe(e, u.y, u.z));
    return sample_if(above(wi, wo), wi, ks * ((e + T(2)) / (e + T(1)) * l.scale * wi.z), pdf(wi, wo));
  }

  /// The lobe as a Phong closure, whose normal is the half vector of the lobe's axis and the viewer. The closure's
  /// cosine refers to that normal instead of the surface's.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    const Lobe l = lobe(wo);
    const Vec3<T> n = normalize(wo + l.axis);
    const T variance = T(1) / (e + T(2));
    const T cosines = lobe_height(l.axis.z, variance) / lobe_height(dot(n, l.axis), variance);
    Closure<T> c = power_closure(ks * (l.scale * cosines), e);
    c.normal = n;
    c.turned = true;
    return {c};
  }
};

BRDFC_MODEL(Lafortune)

}  // namespace brdfc
