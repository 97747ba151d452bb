// SPDX-License-Identifier: GPL-3.0-or-later
#include "represent/controlled.h"

#include "model/sampling.h"

namespace brdfc {
namespace {

/// How often the direction comes from the model.
constexpr double kShareOfModel = 0.75;
/// What closures with ramps keep of their weights where facets have nearly all.
constexpr double kLeastShare = 0.1;

/// Direction above the surface, all alike.
template <class T> Vec3<T> sample_uniform(const T& u1, const T& u2) {
  const T sinTheta = sqrt(u1 * (T(2) - u1)), phi = T(2) * pi<T>() * u2;
  return {sinTheta * cos(phi), sinTheta * sin(phi), T(1) - u1};
}

template <class T> T largest(const Rgb<T>& c) { return maximum(max_component(c), max_component(c * T(-1))); }

}  // namespace

template <class T> Residual<T> sample_residual(const Brdf<T>& brdf, const Fit& fit, const Vec3<T>& wo, const Vec3<T>& u,
                                               const std::type_identity_t<Varied<T>>& varied) {
  const T share = T(kShareOfModel);
  const auto of_model = u.x < share;
  // The number that chooses serves again, stretched.
  const Sample<T> s = brdf.sample(wo, {minimum(u.x / share, T(1 - 1e-7)), u.y, u.z});
  const Vec3<T> wi = select(of_model, s.wi, sample_uniform(u.y, u.z));
  const T density = share * brdf.pdf(wi, wo) + T((1 - kShareOfModel) * kInvPi / 2);
  const Rgb<T> lack = brdf.eval(wi, wo) * wi.z - fit.f_cos(wi, wo, varied);
  // What the model has lost lies below the surface; its density, which says the same, would have to be worked out
  // twice.
  return {wi, select(wi.z > T(0), lack / density, Rgb<T>(T(0)))};
}

template <class T> Controlled<T> controlled(const Brdf<T>& brdf, const Fit& fit, const Vec3<T>& wo, const Vec3<T>& u,
                                            const std::type_identity_t<Varied<T>>& varied) {
  const Residual<T> residual = sample_residual(brdf, fit, wo, u, varied);
  T all(0), of_ramps(0);
  for (const Closure<T>& c : fit.closures(wo, varied)) {
    const T weight = max_component(c.weight);
    all = all + weight;
    if (has_ramp(c.kind)) of_ramps = of_ramps + weight;
  }
  Controlled<T> out;
  out.wi = residual.wi;
  const T worth = named("worth", largest(residual.weight));
  out.weight = named("share_of_residual", worth * all / (worth + all));
  out.colour = residual.weight / maximum(out.weight, tiny<T>());
  const T share = named("share_of_ramps", maximum(T(1) - out.weight / of_ramps, T(kLeastShare)));
  out.closures = fit.closures(wo, varied, share, false);
  return out;
}

template Residual<double> sample_residual(const Brdf<double>&, const Fit&, const Vec3<double>&, const Vec3<double>&,
                                          const Varied<double>&);
template Controlled<double> controlled(const Brdf<double>&, const Fit&, const Vec3<double>&, const Vec3<double>&,
                                       const Varied<double>&);
template Controlled<Expr> controlled(const Brdf<Expr>&, const Fit&, const Vec3<Expr>&, const Vec3<Expr>&,
                                     const Varied<Expr>&);

}  // namespace brdfc
