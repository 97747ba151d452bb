// SPDX-License-Identifier: GPL-3.0-or-later
// The arithmetic of OSL in Blender. It separates OSL's rounding errors from errors of a recording.
#pragma once

#include "trace/graph.h"

namespace brdfc::inline trace {

/// While an object of this class is alive on this thread, Program::run<float> computes as OSL does.
class OslArithmetic {
 public:
  OslArithmetic();
  ~OslArithmetic();
  OslArithmetic(const OslArithmetic&) = delete;
  OslArithmetic& operator=(const OslArithmetic&) = delete;
  static bool active();
};

/// Evaluates one operation with the functions that OSL calls: OpenImageIO's fast versions, quotients and roots that are
/// 0 where they are undefined, and the shaders' own expm1 and log1p.
float apply_as_osl(Op, const float* arguments);

}  // namespace brdfc::inline trace
