// SPDX-License-Identifier: GPL-3.0-or-later
// The scalar types a model is instantiated for, and the vocabulary its formulas are written in.
//
//   double  truth            float  what OSL computes
//   Wide    113-bit mantissa Expr   records the formula (trace/expr.h)
//   Pack    eight doubles at once (core/pack.h)
//
// A model formula is a template over the scalar T and uses only the functions named here, so that one
// text serves all five. There are no data-dependent branches: select() evaluates both arms, hence guard
// the arguments of an arm, not its result.
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <type_traits>

#include "core/vectorised.h"
#include "core/wide.h"

namespace brdfc::inline core {

/// float, double, Wide: types whose comparisons are decided at once.
template <class T>
concept Numeric = std::floating_point<T> || std::same_as<T, Wide>;

inline namespace BRDFC_INSTRUCTION_SET {
class Pack;
}
/// Those and Pack: types that hold values and record nothing.
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

/// a where the condition holds, else b. Both arms are evaluated.
template <Numeric T> T select(bool condition, const T& a, const T& b) { return condition ? a : b; }

/// Smallest positive argument that a guard may hand to log() or a division: normal in float.
template <class T> T tiny() { return T(1e-30); }

template <class T> T sqr(const T& x) { return x * x; }
template <class T> T pow5(const T& x) {
  const T x2 = x * x;
  return x2 * x2 * x;
}
template <class T> T clamp01(const T& x) { return minimum(maximum(x, T(0)), T(1)); }

/// Runs state = step(state) `count` times. The recorded form is an OSL loop, never unrolled.
template <Arithmetic T, std::size_t N, class Step>
std::array<T, N> iterate(int count, std::array<T, N> state, Step step) {
  for (int i = 0; i < count; ++i) state = step(state);
  return state;
}

/// Steps that a safeguarded Newton iteration takes: to 2e-7 of the target in float, to 1e-15 otherwise. A recording
/// takes those of the precision that it is made for.
template <class T> int newton_steps() { return std::same_as<T, float> ? 10 : 24; }

/// Gives a subexpression the name it has in the paper; only the recorded form keeps it.
template <Arithmetic T> const T& named(const char*, const T& x) { return x; }

}  // namespace brdfc::inline core
