// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/osl_arithmetic.h"

#include <OpenImageIO/fmath.h>

#include <cmath>

#include "trace/op.h"

namespace brdfc::inline trace {
namespace {

thread_local int alive = 0;

float divide(float a, float b) {
  const float q = a / b;
  return b != 0 && std::isfinite(q) ? q : 0;
}

// As osl/brdfc.osl.in has them.
float osl_expm1(float x) {
  if (std::abs(x) < 0.4f)
    return x * (1 + x * (1 / 2.0f + x * (1 / 6.0f + x * (1 / 24.0f + x * (1 / 120.0f + x * (1 / 720.0f + x / 5040))))));
  return OIIO::fast_exp(x) - 1;
}

float osl_log1p(float x) {
  if (std::abs(x) < 0.4f) {
    const float z = x / (2 + x), z2 = z * z;
    return 2 * z * (1 + z2 * (1 / 3.0f + z2 * (1 / 5.0f + z2 * (1 / 7.0f + z2 * (1 / 9.0f + z2 / 11)))));
  }
  return OIIO::fast_log(1 + x);
}

}  // namespace

OslArithmetic::OslArithmetic() { ++alive; }
OslArithmetic::~OslArithmetic() { --alive; }
bool OslArithmetic::active() { return alive > 0; }

float apply_as_osl(Op op, const float* a) {
  switch (op) {
    case Op::Div:
      return divide(a[0], a[1]);
    case Op::Sqrt:
      return a[0] > 0 ? std::sqrt(a[0]) : 0;
    case Op::Cbrt:
      return OIIO::fast_cbrt(a[0]);
    case Op::Exp:
      return OIIO::fast_exp(a[0]);
    case Op::Log:
      return OIIO::fast_log(a[0]);
    case Op::Log1p:
      return osl_log1p(a[0]);
    case Op::Expm1:
      return osl_expm1(a[0]);
    case Op::Sin:
      return OIIO::fast_sin(a[0]);
    case Op::Cos:
      return OIIO::fast_cos(a[0]);
    case Op::Atan:
      return OIIO::fast_atan(a[0]);
    case Op::Pow:
      return OIIO::fast_safe_pow(a[0], a[1]);
    default:
      return apply(op, a);
  }
}

}  // namespace brdfc::inline trace
