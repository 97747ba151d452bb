// SPDX-License-Identifier: GPL-3.0-or-later
// Evaluates an operation on numbers: to fold constants, in double precision, and to run a program.
#pragma once

#include <cmath>

#include "core/scalar.h"
#include "trace/graph.h"

namespace brdfc::inline trace {

template <class T> T apply(Op op, const T* a) {
  switch (op) {
    case Op::Add:
      return a[0] + a[1];
    case Op::Sub:
      return a[0] - a[1];
    case Op::Mul:
      return a[0] * a[1];
    case Op::Div:
      return a[0] / a[1];
    case Op::Neg:
      return -a[0];
    case Op::Sqrt:
      return std::sqrt(a[0]);
    case Op::Cbrt:
      return std::cbrt(a[0]);
    case Op::Exp:
      return std::exp(a[0]);
    case Op::Log:
      return std::log(a[0]);
    case Op::Log1p:
      return std::log1p(a[0]);
    case Op::Expm1:
      return std::expm1(a[0]);
    case Op::Sin:
      return std::sin(a[0]);
    case Op::Cos:
      return std::cos(a[0]);
    case Op::Atan:
      return std::atan(a[0]);
    case Op::Pow:
      return std::pow(a[0], a[1]);
    case Op::Abs:
      return std::abs(a[0]);
    case Op::Min:
      return core::minimum(a[0], a[1]);
    case Op::Max:
      return core::maximum(a[0], a[1]);
    case Op::Less:
      return T(a[0] < a[1]);
    case Op::LessEqual:
      return T(a[0] <= a[1]);
    case Op::And:
      return T(a[0] != T(0) && a[1] != T(0));
    case Op::Or:
      return T(a[0] != T(0) || a[1] != T(0));
    case Op::Not:
      return T(a[0] == T(0));
    case Op::Select:
      return a[0] != T(0) ? a[1] : a[2];
    default:
      throw ExprError("operation without a value");
  }
}

}  // namespace brdfc::inline trace
