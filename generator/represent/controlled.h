// SPDX-License-Identifier: GPL-3.0-or-later
// A controlled form: the closures of a fit, and what the model has more or less than they in one direction that the
// shader draws, as a lobe as narrow as those of a sampled form. Equal to the model in expectation, whatever the fit.
#pragma once

#include "represent/fit.h"

namespace brdfc {

/// What the closures lack (negative: have too much) in a direction, over the density of drawing it.
template <class T> struct Residual {
  Vec3<T> wi;
  Rgb<T> weight;
};

/// u: three numbers in [0, 1). The directions come from the model, and some from everywhere: closures give light where
/// the model draws nothing. Everywhere is uniform and not by the cosine, because closures on tilted normals do not
/// vanish at the horizon.
template <class T> Residual<T> sample_residual(const Brdf<T>&, const Fit&, const Vec3<T>& wo, const Vec3<T>& u,
                                               const std::type_identity_t<Varied<T>>& varied = {});

/// What a controlled form hands to Cycles. Cycles follows closures in proportion to their weights, so the drawn
/// direction has for weight what it is worth without its sign, and the closures give that up; sign and colour are in
/// the ramp.
template <class T> struct Controlled {
  ClosureSum<T> closures;  ///< colours still to be divided by the weights, as Fit::closures() may leave them
  Vec3<T> wi;
  T weight;
  Rgb<T> colour;  ///< of the lobe about wi: `weight` times this is the residual
};
template <class T> Controlled<T> controlled(const Brdf<T>&, const Fit&, const Vec3<T>& wo, const Vec3<T>& u,
                                            const std::type_identity_t<Varied<T>>& varied = {});

extern template Residual<double> sample_residual(const Brdf<double>&, const Fit&, const Vec3<double>&,
                                                 const Vec3<double>&, const Varied<double>&);
extern template Controlled<double> controlled(const Brdf<double>&, const Fit&, const Vec3<double>&, const Vec3<double>&,
                                              const Varied<double>&);
extern template Controlled<Expr> controlled(const Brdf<Expr>&, const Fit&, const Vec3<Expr>&, const Vec3<Expr>&,
                                            const Varied<Expr>&);

}  // namespace brdfc
