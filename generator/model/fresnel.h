// SPDX-License-Identifier: GPL-3.0-or-later
// The Fresnel equations for unpolarised light, in forms without cancellation.
//
// cosTheta > 0 and sin2 = sin^2 theta are those of the direction on the incident side; indices are relative to that
// side.
#pragma once

#include "core/vec.h"

namespace brdfc::inline model {

/// Schlick's approximation, from the reflectance at normal incidence and 1 - cos theta.
template <class T> Rgb<T> schlick_fresnel(const Rgb<T>& f0, const T& one_minus_cos) {
  return f0 + (Rgb<T>(T(1)) - f0) * pow5(one_minus_cos);
}

/// u, v^2 and |u + i v|^2 of u + i v = sqrt((n + i k)^2 - sin^2). The larger of u^2 and v^2 is computed from the
/// root, the smaller from u v = n k.
template <class T> struct ConductorRoot { T u, v2, modulus; };
template <class T> ConductorRoot<T> conductor_root(const T& sin2, const T& n, const T& k) {
  const T nk = n * k;
  const T real = named("real", (n - k) * (n + k) - sin2);
  const T modulus = named("modulus", sqrt(real * real + T(4) * nk * nk));
  const T large = named("large", (modulus + abs(real)) / T(2));
  const T small = named("small", nk * nk / maximum(large, tiny<T>()));
  const T u = named("u_root", sqrt(select(real > T(0), large, small)));
  return {u, named("v2", select(real > T(0), small, large)), modulus};
}

/// Reflectance of a conductor n + i k. With u + i v = sqrt((n + i k)^2 - sin^2),
///   R_s = ((u - c)^2 + v^2) / ((u + c)^2 + v^2),  R_p = R_s ((u c - s^2)^2 + v^2 c^2) / ((u c + s^2)^2 + v^2 c^2),
/// which are quotients of sums of squares.
template <class T> T fresnel_conductor(const T& cosTheta, const T& sin2, const T& n, const T& k) {
  const auto [u, v2, modulus] = conductor_root(sin2, n, k);
  const T Rs = named("R_s", (sqr(u - cosTheta) + v2) / (sqr(u + cosTheta) + v2));
  const T uc = named("uc", u * cosTheta), vc2 = named("vc2", v2 * cosTheta * cosTheta);
  const T Rp = named("R_p", Rs * ((sqr(uc - sin2) + vc2) / (sqr(uc + sin2) + vc2)));
  return (Rs + Rp) / T(2);
}

/// The shares of light that a smooth dielectric boundary reflects and transmits; their sum is 1.
template <class T> struct Dielectric { T reflected, refracted; };

/// The transmitted share where the cosine of the refracted direction is known: `g` is that times `eta`. A direction
/// that is given by a half vector has g = eta |wi.h|, which is precise near the critical angle, where sin^2 is not.
template <class T> T refracted_share(const T& cosTheta, const T& g, const T& eta) {
  const T eta2 = eta * eta;
  const T ds = named("d_s", sqr(cosTheta + g)), dp = named("d_p", sqr(eta2 * cosTheta + g));
  return T(2) * cosTheta * g * (T(1) / ds + eta2 / dp);
}

/// `eta` is the index of the far side divided by that of the incident side. With g^2 = eta^2 - sin^2,
///   r_s = (1 - eta^2) / (c + g)^2,  r_p = (eta^2 - 1) (eta^2 c^2 - s^2) / (eta^2 c + g)^2,
/// where differences of similar numbers are expanded. T has its own formula and is not computed as 1 - R. `step` is
/// eta^2 - 1, for callers that know it better.
template <class T> Dielectric<T> fresnel_dielectric(const T& cosTheta, const T& sin2, const T& eta, const T& step) {
  const T sine = sqrt(sin2), c2 = cosTheta * cosTheta;
  // eta^2 - sin^2; near the horizon computed from the cosine.
  const T g2 = named("g2", select(c2 < T(0.5), c2 + step, (eta - sine) * (eta + sine)));
  const auto total = g2 <= T(0);  // total internal reflection
  const T g = named("g", sqrt(maximum(g2, T(0))));
  const T eta2 = eta * eta;
  const T ds = named("d_s", sqr(cosTheta + g)), dp = named("d_p", sqr(eta2 * cosTheta + g));
  const T rs = named("r_s", step / ds);
  const T ec = eta * cosTheta;
  const T rp = named("r_p", step * ((ec - sine) * (ec + sine)) / dp);
  const T through = refracted_share(cosTheta, g, eta);
  return {named("R_f", select(total, T(1), (rs * rs + rp * rp) / T(2))), named("T_f", select(total, T(0), through))};
}

template <class T> Dielectric<T> fresnel_dielectric(const T& cosTheta, const T& sin2, const T& eta) {
  return fresnel_dielectric(cosTheta, sin2, eta, (eta - T(1)) * (eta + T(1)));
}

/// The same for a direction on either side of the surface. `ior` is the index inside (z < 0) divided by the one
/// outside.
template <class T> Dielectric<T> fresnel_dielectric(const Vec3<T>& wo, const T& ior) {
  return fresnel_dielectric(abs(wo.z), named("sin2", sin2_theta(wo)),
                            named("eta", select(wo.z > T(0), ior, T(1) / ior)));
}

}  // namespace brdfc::inline model
