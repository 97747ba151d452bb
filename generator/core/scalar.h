// SPDX-License-Identifier: GPL-3.0-or-later
// The scalar types that models are instantiated for, and the functions that formulas may use.
//
//   double  reference        float  what OSL computes
//   Wide    113-bit mantissa Expr   records the formula (trace/expr.h)
//   Pack    eight doubles at once (core/pack.h)
//
// A model formula is a template over the scalar T and uses only the functions of this file, so that one text serves all
// five types. There are no data-dependent branches: select() evaluates both arms, so guard the arguments of an arm, not
// its result.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <type_traits>

#include "core/vectorised.h"
#include "core/wide.h"

namespace brdfc::inline core {

/// float, double and Wide: types whose comparisons give a bool.
template <class T>
concept Numeric = std::floating_point<T> || std::same_as<T, Wide>;

inline namespace BRDFC_INSTRUCTION_SET {
class Pack;
}
/// Numeric types and Pack: types that hold values, as opposed to Expr, which records.
template <class T>
concept Arithmetic = Numeric<T> || std::same_as<T, Pack>;

using std::abs;
using std::atan;
using std::cbrt;
using std::cos;
using std::exp;
using std::expm1;
using std::log;
using std::log1p;
using std::pow;
using std::sin;
using std::sqrt;

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kInvPi = 0.31830988618379067154;

/// pi to the precision of T.
template <class T> T pi() {
  if constexpr (std::same_as<T, Wide>) {
    static const Wide value = Wide(4) * atan(Wide(1));
    return value;
  } else
    return T(kPi);
}

template <Numeric T> T minimum(const T& a, const T& b) { return b < a ? b : a; }
template <Numeric T> T maximum(const T& a, const T& b) { return a < b ? b : a; }

/// Returns a if the condition holds, else b. Both arms are evaluated.
template <Numeric T> T select(bool condition, const T& a, const T& b) { return condition ? a : b; }

/// Smallest positive argument that a guard may pass to log() or to a division. It is a normal number in float.
template <class T> T tiny() { return T(1e-30); }

template <class T> T sqr(const T& x) { return x * x; }
template <class T> T pow5(const T& x) {
  const T x2 = x * x;
  return x2 * x2 * x;
}
template <class T> T clamp01(const T& x) { return minimum(maximum(x, T(0)), T(1)); }

/// Repeats state = step(state) `count` times. Recorded, it becomes an OSL loop, which is never unrolled.
template <Arithmetic T, std::size_t N, class Step>
std::array<T, N> iterate(int count, std::array<T, N> state, Step step) {
  for (int i = 0; i < count; ++i) state = step(state);
  return state;
}

/// Number of steps of a safeguarded Newton iteration. It reaches the target to 2e-7 in float and to 1e-15 otherwise. A
/// recording uses the number for the precision that it is made for.
template <class T> int newton_steps() { return std::same_as<T, float> ? 10 : 24; }

/// Gives a subexpression the name that it has in the paper. Only the recorded form keeps the name.
template <Arithmetic T> const T& named(const char*, const T& x) { return x; }

}  // namespace brdfc::inline core
