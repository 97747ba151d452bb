// SPDX-License-Identifier: GPL-3.0-or-later
// A rough dielectric boundary without errors; not registered.
//
// B. Walter, S. Marschner, H. Li, K. Torrance: Microfacet Models for Refraction through Rough Surfaces, EGSR 2007, with
// GGX. A half vector is sampled first, and then reflection or refraction, with the probabilities from the Fresnel
// equations for that half vector. So the value of the first random number that separates the two depends on the other
// two numbers.
#pragma once

#include "model/fresnel.h"
#include "model/sampling.h"

namespace brdfc::testing_models {

template <class T> struct RoughDielectric {
  T alpha, eta;

  static ModelInfo info() {
    return {.name = "rough_dielectric",
            .label = "Rough dielectric",
            .look = Look::Glass,
            .paper = "",
            .equations = "",
            .doc = "",
            .properties = {.positive = false, .smooth = false, .exact_sampling = false},
            .params = {}};
  }
  template <class Visitor> void parameters(const Visitor& v) {
    v(alpha, NumberSpec{"alpha", "Roughness", 0.3, 0.05, 1, 0.05, 1, ""}.by_factors());
    v(eta, NumberSpec{"ior", "IOR", 1.5, 1.1, 3, 1.1, 3, ""});
  }

  T ior() const { return eta; }
  bool scatters_through() const { return true; }

  /// D(h), eq. 33.
  T distribution(const Vec3<T>& h) const {
    return T(1) / (pi<T>() * sqr(alpha) * sqr((sqr(h.x) + sqr(h.y)) / sqr(alpha) + sqr(h.z)));
  }
  /// G1(w), eq. 34.
  T masking(const Vec3<T>& w) const {
    const T z = maximum(abs(w.z), tiny<T>());
    return T(2) * z / (z + sqrt(sqr(alpha) * (sqr(w.x) + sqr(w.y)) + sqr(z)));
  }
  /// The index on the far side divided by that on wo's side.
  T relative_index(const Vec3<T>& wo) const { return select(wo.z > T(0), eta, T(1) / eta); }
  Dielectric<T> fresnel(const Vec3<T>& o, const Vec3<T>& h, const T& n) const {
    // |o x h|^2 for unit vectors.
    const Vec3<T> c = cross(o, h);
    return fresnel_dielectric(maximum(dot(o, h), T(0)), dot(c, c), n);
  }

  /// f and the pdf, which have all factors but one in common.
  struct Both {
    T f, pdf;
  };
  Both both(const Vec3<T>& wi, const Vec3<T>& wo) const {
    const T side = select(wo.z > T(0), T(1), T(-1)), n = relative_index(wo);
    const Vec3<T> o = wo * side, i = wi * side;
    const auto reflects = i.z > T(0);
    const Vec3<T> halves = select(reflects, i + o, -(o + i * n));
    const T len = maximum(length(halves), tiny<T>());
    const T up = select(halves.z < T(0), T(-1), T(1));
    const Vec3<T> h = halves * (up / len);
    const T oh = dot(o, h), ih = dot(i, h);
    const T half = maximum(abs(oh), tiny<T>());
    const T jacobian = select(reflects, T(1) / (T(4) * half), sqr(n) * abs(ih) / maximum(sqr(oh + n * ih), tiny<T>()));
    // By the sine, float would be off by 2e-3 near the critical angle.
    const T chance = select(reflects, fresnel(o, h, n).reflected, refracted_share(abs(oh), n * abs(ih), n));
    const auto exists = oh > T(0) && (reflects || ih < T(0)) && abs(i.z) > T(0);
    const T density = chance * distribution(h) * jacobian;
    const T f = density * masking(i) * masking(o) * half / (maximum(abs(i.z), tiny<T>()) * maximum(o.z, tiny<T>()));
    return {select(exists, f, T(0)), select(exists, density * maximum(h.z, T(0)), T(0))};
  }
  Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const { return Rgb<T>(both(wi, wo).f); }
  T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const { return both(wi, wo).pdf; }

  Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
    const T side = select(wo.z > T(0), T(1), T(-1)), n = relative_index(wo);
    const Vec3<T> o = wo * side;
    const T slope = alpha * sqrt(u.y / maximum(T(1) - u.y, tiny<T>())), phi = T(2) * pi<T>() * u.z;
    const T cosTheta = T(1) / sqrt(T(1) + sqr(slope));
    const Vec3<T> h{slope * cosTheta * cos(phi), slope * cosTheta * sin(phi), cosTheta};
    const T oh = dot(o, h);
    const Vec3<T> c = cross(o, h);
    const T far2 = T(1) - dot(c, c) / sqr(n);
    const auto reflects = u.x < fresnel(o, h, n).reflected;
    const Vec3<T> mirrored = h * (T(2) * oh) - o, bent = h * (oh / n - sqrt(maximum(far2, T(0)))) - o / n;
    const Vec3<T> i = normalize(select(reflects, mirrored, bent)), wi = i * side;
    const Both at = both(wi, wo);
    const auto own_side = (reflects && i.z > T(0)) || (!reflects && i.z < T(0));
    const auto exists = oh > T(0) && own_side && at.pdf > T(0);
    return sample_if(exists, wi, Rgb<T>(at.f * abs(wi.z) / maximum(at.pdf, tiny<T>())), at.pdf);
  }
};

}  // namespace brdfc::testing_models
