// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/osl_arithmetic.h"

#include <OpenImageIO/fmath.h>

#include <cmath>

#include "core/series.h"
#include "trace/op.h"

namespace brdfc::inline trace {
namespace {

thread_local int alive = 0;

float divide(float a, float b) {
  const float q = a / b;
  return b != 0 && std::isfinite(q) ? q : 0;
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
    // As in osl/brdfc.osl.in.
    case Op::Log1p:
      return series_log1p(a[0], OIIO::fast_log(1 + a[0]));
    case Op::Expm1:
      return series_expm1(a[0], OIIO::fast_exp(a[0]));
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
