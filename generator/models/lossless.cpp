// SPDX-License-Identifier: GPL-3.0-or-later
// Lossless reflection constructed from a kernel: sech^2 (eq. 14), e^-u, or a curve given by four heights. The
// construction, its equations and its numerical stability are described in model/kernel_lobe.h.
//
// M. Radziszewski, W. Alda: Family of Energy Conserving Glossy Reflection Models, 2008, eqs. 9-16.
#include "model/base_terms.h"
#include "model/kernel_lobe.h"
#include "model/latitudinal_lobe.h"

namespace brdfc {

template <class T> struct Lossless : KernelLobe<T, EvenKnots<T, 4>> {
  using Base = KernelLobe<T, EvenKnots<T, 4>>;

  static ModelInfo info() {
    return {.name = "lossless",
            .label = "Lossless Kernel",
            .look = Look::Special,
            .paper = "M. Radziszewski, W. Alda: Family of Energy Conserving Glossy Reflection Models, 2008",
            .equations = "eqs. 9-16",
            .doc = "Latitudinal reflection without loss made from a kernel; the light spreads over all azimuths.",
            .properties = {.lossless = true,
                           .smooth = false,  // the exponential kernel has an edge at x = y, a drawn one at its knots
                           .diffuse_limit = "n=0"},
            .params = {}};
  }

  template <class Visitor> void parameters(const Visitor& v) {
    v(this->kernel,
      ChoiceSpec{"kernel",
                 "Kernel",
                 {"sech2", "exponential", "table"},
                 "Shape k(u): sech^2 u (eq. 14), e^-u, or a curve drawn by its heights at u = 0, 1, 2, 3"});
    v(this->n, NumberSpec{"n", "Glossiness", 4, 0, 1e4, 0, 100, "Glossiness n: 0 is matte"}.by_factors());
    static constexpr const char* kNames[] = {"h0", "h1", "h2", "h3"};
    static constexpr const char* kLabels[] = {"Height 0", "Height 1", "Height 2", "Height 3"};
    static constexpr double kDrawn[] = {1, 0.6, 0.2, 0.1};
    for (int i = 0; i < this->drawn.count(); ++i)
      v(this->drawn.heights[std::size_t(i)],
        NumberSpec{kNames[i], kLabels[i], kDrawn[i], 1e-3, 1, 1e-3, 1,
                   "Height of the drawn kernel at the distance of this number, over 1 / n"}
            .by_factors());
    v(this->tint, ColorSpec{"tint", "Tint", {1, 1, 1}, "Share of the light that is reflected"}.as(Optical::Tint));
  }

  /// The reflected light depends on the height of wi alone, as that of a ramp closure does. The ramp's colours are
  /// those of sech^2 in closed form, scaled so that no light is lost. From n = 5 on, eight colours are too few, and
  /// sampled directions alone have less noise.
  ClosureSum<T> base(const Vec3<T>& wo) const {
    if (this->kernel != Base::Sech2) return {};
    constexpr double kStep = 1. / (kRampSize - 1);
    Closure<T> c(ClosureKind::DiffuseRamp, this->tint);
    T sum(0);
    for (int i = 0; i < kRampSize; ++i) {
      const double z = i * kStep;
      const Vec3<T> wi = {T(std::sqrt(1 - z * z)), T(0), T(z)};
      const T height = latitudinal_lobe(this->n, wi, wo) * T(z / 2);
      c.ramp[std::size_t(i)] = Rgb<T>(height);
      sum = sum + height * T(i < kRampSize - 1 ? 2 * kStep : kStep);
    }
    c.weight = c.weight * (clamp01(T(5) - this->n) / maximum(sum, T(0.5)));
    return {c};
  }
};

BRDFC_MODEL(Lossless)

}  // namespace brdfc
