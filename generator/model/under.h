// SPDX-License-Identifier: GPL-3.0-or-later
// The base of the form of nodes: closures that are nowhere above a model. Without Open Shading Language Cycles drops
// closures of negative weight, so what a base gives beyond the model could not be taken off again.
//
// A model declares them as under(wo), and registers that with BRDFC_UNDER after BRDFC_MODEL. For any parameters and
// directions their sum is at most f cos(theta_i), but for 2e-4 of the model's light; weights are not negative. They are
// of kinds that Blender has a node for: Diffuse, OrenNayar with the weight 1, DiffuseToon, Ggx and Beckmann, also as
// metal with a grey weight from 0 to 1, all about the surface's normal. Anisotropic facets are stretched along the x
// axis or the view. For all choices the kinds are the same; a choice may have the weight 0.
//
// A model that these closures equal for some parameters says so by whole(), and is then made of them alone, in the form
// of nodes and in the aimed form.
#pragma once

#include <array>

#include "model/base_terms.h"
#include "model/bound_as.h"
#include "model/mirror_side.h"
#include "model/model.h"

namespace brdfc::inline model {

/// Blender's Metallic BSDF takes no roughness that is less than this times the other one.
inline constexpr double kLeastAspect = 0.1;

/// The base of a model.
struct Under {
  /// With the parameters as Model::record() has them. A Recorder must be active.
  ClosureSum<Expr> (*record)(const ModelInfo&, const ParamValues& fixed, const Vec3<Expr>& wo);
  ClosureSum<double> (*bound)(const ModelInfo&, const ParamValues&, const Vec3<double>& wo);
  /// As Brdf::sample(), for what the base leaves of f; null where that serves well enough. The pdf is above 0 wherever
  /// the base, times `stands`, is less than f cos(theta_i).
  Sample<Expr> (*sample)(const ModelInfo&, const ParamValues& fixed, const Vec3<Expr>& wo, const Vec3<Expr>& u,
                         const Expr& stands);
  /// 1 where the base is all of the model, otherwise 0: it depends on the parameters alone. Null where it never is.
  Expr (*record_whole)(const ModelInfo&, const ParamValues& fixed);
  double (*bound_whole)(const ModelInfo&, const ParamValues&);
};
/// That of the model, or a null pointer.
inline const Under* under(const Model& model) { return beside<Under>(model); }
/// Whether the model's base is all of it for some parameters.
inline bool has_whole(const Model& model) { return under(model) && under(model)->record_whole; }
/// Called by BRDFC_UNDER before main().
inline bool register_under(const std::string& name, const Under& closures) {
  return registered_beside<Under>().emplace(name, closures).second;
}

/// A term that depends on the polar angle of the light alone, from below: two cones about the normal. Their sum has
/// `heights` at the normal and at the first of `angles`, is linear between, and 0 from the second on. Angles are in
/// units of 90 degrees.
template <class T> ClosureSum<T> cones_under(const Rgb<T>& weight, const std::array<double, 2>& heights,
                                             const std::array<double, 2>& angles) {
  ClosureSum<T> sum;
  for (std::size_t i = 0; i < 2; ++i) {
    // Over 2 pi (1 - cos) a cone's height is 1.
    const double drop = 4 * kPi * std::pow(std::sin(angles[i] * kPi / 4), 2);
    const double height = heights[i] - (i == 0 ? heights[1] : 0);
    Closure<T>& c = sum.emplace_back(ClosureKind::DiffuseToon, weight * T(height * drop));
    c.size = T(i == 0 ? 0 : angles[0]);
    c.smooth = T(i == 0 ? angles[0] : angles[1] - angles[0]);
  }
  return sum;
}

/// Microfacets with Beckmann's distribution below others with the slopes `ax` and `ay`. Their own slopes are less by
/// the factors sqrt(1 + narrow_x) and sqrt(1 + narrow_y), and their peak has the height of the others' peak times
/// `weight`.
template <class T>
Closure<T> narrower_facets(const Rgb<T>& weight, const T& ax, const T& ay, const T& narrow_x, const T& narrow_y) {
  const T x = T(1) / sqrt(T(1) + narrow_x), y = T(1) / sqrt(T(1) + narrow_y);
  return facets(ClosureKind::Beckmann, weight * (x * y), ax * x, ay * y, T(0));
}
/// By how much facets of the slope `a` become narrower, to lie below a model of such facets that loses more light than
/// Smith's masking where directions are close to the horizon. What is still too bright is less than 2e-4 of the light,
/// for slopes from 0.01 to 1. The constants were found by bisection for Ward's and Cook and Torrance's models.
template <class T> T narrow_towards_horizon(const T& a, const Vec3<T>& wo) {
  const T x2 = sqr(a / wo.z);
  return T(4.2) * x2 / (T(1) + T(2) * x2);
}

/// Microfacets with Beckmann's distribution below cos^e alpha about the mirror direction, for e >= 1.
///
/// Let s be a slope of the half vector and c the cosine of the view. In the plane of incidence alpha is 2 theta_h, so
/// cos^e alpha is ((1 - s^2) / (1 + s^2))^e = exp(-2 e s^2 - ...), and the facets have (1 + s^2)^2 exp(-s^2 / a^2),
/// which is less for a^2 = 1 / (2 e + 2). Across the plane cos alpha is 1 - 2 c^2 s^2 / (1 + s^2), so the slopes there
/// are larger: 1 / (2 e c^2 + 2). At the mirror direction both are equal with the weight sqrt((e + 1) c^2 / (e c^2 +
/// 1)). Masking takes light towards the horizon. Where the power is small, the facets exceed it by less than 2e-4 of
/// its light.
template <class T> Closure<T> power_facets_under(const Rgb<T>& weight, const T& e, const Vec3<T>& wo) {
  const T more = T(1) + T(2.8) / (e + T(1)), c2 = sqr(wo.z);  // 1 does for large e
  const T x = T(1) / (e + more), y = T(1) / (e * c2 + more);
  Closure<T> c(ClosureKind::Beckmann, weight * (wo.z * (e + T(1)) * sqrt(x * y)));
  c.alpha = facet_alpha(sqrt(x / T(2)));
  c.alpha_across = facet_alpha(sqrt(y / T(2)));
  c.tangent = mirror_side(wo);
  c.stretched = Tangent::View;
  return c;
}
/// The part of cos^e alpha that power_facets_under() takes, on average over views.
inline constexpr double kPowerUnder = 0.9;

namespace detail {

template <class M>
concept SamplesBesideUnder = requires(const M& m, const Vec3<double>& w) {
  m.sample_beside_under(w, w, 1.0);
};

template <class M>
concept HasWhole = requires(const M& m) {
  m.whole();
};

template <template <class> class M> Under under_of() {
  Under out{[](const ModelInfo& info, const ParamValues& fixed, const Vec3<Expr>& wo) {
              return recorded_as<M>(info, fixed).under(wo);
            },
            [](const ModelInfo& info, const ParamValues& given, const Vec3<double>& wo) {
              return bound_as<M>(info, given).under(wo);
            },
            nullptr, nullptr, nullptr};
  if constexpr (SamplesBesideUnder<M<double>>)
    out.sample = [](const ModelInfo& info, const ParamValues& fixed, const Vec3<Expr>& wo, const Vec3<Expr>& u,
                    const Expr& stands) { return recorded_as<M>(info, fixed).sample_beside_under(wo, u, stands); };
  if constexpr (HasWhole<M<double>>) {
    out.record_whole = [](const ModelInfo& info, const ParamValues& fixed) {
      return recorded_as<M>(info, fixed).whole();
    };
    out.bound_whole = [](const ModelInfo& info, const ParamValues& given) { return bound_as<M>(info, given).whole(); };
  }
  return out;
}

}  // namespace detail

#if BRDFC_BASELINE
#define BRDFC_UNDER(M)                       \
  bool the_class_##M##_has_closures_under_ = \
      ::brdfc::register_under(M<double>::info().name, ::brdfc::model::detail::under_of<M>());
#else
#define BRDFC_UNDER(M)
#endif

}  // namespace brdfc::inline model
