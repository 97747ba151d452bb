// SPDX-License-Identifier: GPL-3.0-or-later
// Models with deliberate errors; they are not registered.
#pragma once

#include "model/sampling.h"

namespace brdfc::faulty {

// Lambert's reflector with one error at a time.
enum Defect {
  kNone,
  kPdf,
  kSampler,
  kReciprocity,
  kNegative,
  kNan,
  kUnstable,
  kGain,
  kTurn,
  kColorCubed,
  kClosure,
  kDark,
  kEdge,
  kShadow,
  kModest,
  kLong,
  kBelow,
  kPdfBelow
};

template <Defect D> struct Faulty {
  template <class T> struct Type {
    Rgb<T> rho;
    T level;

    static ModelInfo info() {
      return {.name = "faulty",
              .label = "Faulty",
              .paper = "",
              .equations = "",
              .doc = "",
              .properties = D == kModest ? ModelProperties{.reciprocal = false,
                                                           .conserving = false,
                                                           .lossless = false,
                                                           .isotropic = false,
                                                           .positive = false,
                                                           .smooth = false,
                                                           .exact_sampling = false,
                                                           .specular_limit = "level=1000"}
                                         : ModelProperties{.lossless = true, .diffuse_limit = "level=1"},
              .params = {}};
    }
    template <class Visitor> void parameters(const Visitor& v) {
      v(rho, ColorSpec{"rho", "Reflectance", {0.8, 0.8, 0.8}, ""});
      v(level, NumberSpec{"level", "Level", 1, 0, 1000, 0, 1000, ""}.by_factors());
    }
    Rgb<T> eval(const Vec3<T>& wi, const Vec3<T>& wo) const {
      Rgb<T> f = rho / pi<T>();
      if (D == kReciprocity) f = f * (T(1) + T(0.01) * wo.x);
      if (D == kNegative) f = f * select(wi.z < T(0.2), T(-1e-3), T(1));
      if (D == kNan) f = f * select(wi.z < T(0.2) && level > T(900), T(std::numeric_limits<double>::quiet_NaN()), T(1));
      if (D == kUnstable) f = f * (T(1) + (T(1e6) + wi.z * wi.z) - (T(1e6) + wi.z * wi.z * T(0.999)));
      if (D == kGain) f = f * T(1.01);
      if (D == kTurn) f = f * (T(1) + T(0.01) * wi.x * wo.x);
      if (D == kColorCubed) f = f * rho * rho;
      if (D == kDark) f = f * sqr(maximum(wi.x * wo.x + wi.y * wo.y + T(0.5), T(0)));
      if (D == kEdge) f = f * (T(1) - T(0.05) * abs(wi.x + wo.x));
      // Decreases smoothly, and so fast that it underflows.
      if (D == kShadow) f = f * exp(-level * level * (sqr(wi.x) + sqr(wo.x)));
      if (D == kBelow) return f;
      return select(above(wi, wo), f, Rgb<T>(T(0)));
    }
    T pdf(const Vec3<T>& wi, const Vec3<T>& wo) const {
      if (D == kPdfBelow) return cosine_pdf(wi);
      return select(above(wi, wo), D == kPdf ? T(1) / (T(2) * pi<T>()) : cosine_pdf(wi), T(0));
    }
    Sample<T> sample(const Vec3<T>& wo, const Vec3<T>& u) const {
      Vec3<T> wi = sample_cosine(D == kSampler ? T(0.98) * u.y : u.y, u.z);
      if (D == kLong) wi = wi * T(1.001);
      const T p = pdf(wi, wo);
      return sample_if(above(wi, wo), wi, eval(wi, wo) * (wi.z / maximum(p, tiny<T>())), p);
    }
    ClosureSum<T> exact(const Vec3<T>&) const {
      Closure<T> c(ClosureKind::Diffuse, rho);
      if (D == kClosure) c.weight = c.weight * T(1.0001);
      return {c};
    }
  };
};

}  // namespace brdfc::faulty
