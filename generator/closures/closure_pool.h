// SPDX-License-Identifier: GPL-3.0-or-later
// What closures take of the memory that a GPU has for those of a shading point.
#pragma once

#include "closures/closure.h"

namespace brdfc::inline closures {

/// On OptiX the closures of a shading point lie in a pool of 1,024 bytes, and Cycles does not check whether they fit:
/// what is too much overwrites other data. (osl_eval_nodes() in Cycles' kernel/osl/osl.h, osl_allocate_*() and
/// rs_allocate_closure() in kernel/osl/services_gpu.h; 4.5, 5.0 and 5.2 alike.) What is in it is aligned to 8 bytes,
/// to which the pool itself need not be.
inline constexpr int kPoolBytes = 1024 - 8;
/// What a sum of two closures takes of it, and a product of a closure and a number (OSLClosureAdd, OSLClosureMul in
/// kernel/osl/types.h). With a colour OSL makes closure and product one (peephole2() in its runtimeoptimize.cpp).
inline constexpr int kPoolNode = 24;
/// What a closure with its weight takes of it, in bytes.
int pool_bytes(ClosureKind);

}  // namespace brdfc::inline closures
