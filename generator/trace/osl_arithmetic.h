// SPDX-License-Identifier: GPL-3.0-or-later
// The arithmetic that OSL uses in Blender, to tell what it costs from what a recording gets wrong.
#pragma once

namespace brdfc {
inline namespace trace {

/// While one is alive on this thread, Program::run<float> uses the functions that OSL calls (OpenImageIO's fast ones,
/// quotients and roots that are 0 where they are not defined, and the shaders' own expm1 and log1p).
class OslArithmetic {
 public:
  OslArithmetic();
  ~OslArithmetic();
  OslArithmetic(const OslArithmetic&) = delete;
  OslArithmetic& operator=(const OslArithmetic&) = delete;
  static bool active();
};

namespace osl {
float divide(float a, float b);
float sqrt(float);
float cbrt(float);
float exp(float);
float log(float);
float log1p(float);
float expm1(float);
float sin(float);
float cos(float);
float atan(float);
float pow(float base, float exponent);
}  // namespace osl

}  // namespace trace
}  // namespace brdfc
