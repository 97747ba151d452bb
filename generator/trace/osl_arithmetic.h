// SPDX-License-Identifier: GPL-3.0-or-later
// The arithmetic that OSL uses in Blender, to tell what it costs from what a recording gets wrong.
#pragma once

#include "trace/graph.h"

namespace brdfc::inline trace {

/// While one is alive on this thread, Program::run<float> computes as OSL does.
class OslArithmetic {
 public:
  OslArithmetic();
  ~OslArithmetic();
  OslArithmetic(const OslArithmetic&) = delete;
  OslArithmetic& operator=(const OslArithmetic&) = delete;
  static bool active();
};

/// One operation, with the functions that OSL calls: OpenImageIO's fast ones, quotients and roots that are 0 where they
/// are not defined, and the shaders' own expm1 and log1p.
float apply_as_osl(Op, const float* arguments);

}  // namespace brdfc::inline trace
