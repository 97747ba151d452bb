// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/osl_arithmetic.h"

#include <OpenImageIO/fmath.h>

#include <cmath>

namespace brdfc {
inline namespace trace {
namespace {
thread_local int alive = 0;
}

OslArithmetic::OslArithmetic() { ++alive; }
OslArithmetic::~OslArithmetic() { --alive; }
bool OslArithmetic::active() { return alive > 0; }

namespace osl {

float divide(float a, float b) {
  const float q = a / b;
  return b != 0 && std::isfinite(q) ? q : 0;
}
float sqrt(float x) { return x > 0 ? std::sqrt(x) : 0; }
float cbrt(float x) { return OIIO::fast_cbrt(x); }
float exp(float x) { return OIIO::fast_exp(x); }
float log(float x) { return OIIO::fast_log(x); }
float sin(float x) { return OIIO::fast_sin(x); }
float cos(float x) { return OIIO::fast_cos(x); }
float atan(float x) { return OIIO::fast_atan(x); }
float pow(float base, float exponent) { return OIIO::fast_safe_pow(base, exponent); }

// As osl/brdfc.osl.in has them.
float expm1(float x) {
  if (std::abs(x) < 0.4f)
    return x * (1 + x * (1 / 2.0f + x * (1 / 6.0f + x * (1 / 24.0f + x * (1 / 120.0f + x * (1 / 720.0f + x / 5040))))));
  return exp(x) - 1;
}

float log1p(float x) {
  if (std::abs(x) < 0.4f) {
    const float z = x / (2 + x), z2 = z * z;
    return 2 * z * (1 + z2 * (1 / 3.0f + z2 * (1 / 5.0f + z2 * (1 / 7.0f + z2 * (1 / 9.0f + z2 / 11)))));
  }
  return log(1 + x);
}

}  // namespace osl
}  // namespace trace
}  // namespace brdfc
