// SPDX-License-Identifier: GPL-3.0-or-later
// The memory that the closures of a shading point take on a GPU.
#pragma once

#include "closures/closure.h"

namespace brdfc::inline closures {

/// On OptiX the closures of a shading point are in a pool of 1,024 bytes. Cycles does not check whether they fit: an
/// overflow overwrites other data. (osl_eval_nodes() in Cycles' kernel/osl/osl.h, osl_allocate_*() and
/// rs_allocate_closure() in kernel/osl/services_gpu.h; the same in 4.5, 5.0 and 5.2.) The contents are aligned to 8
/// bytes, but the pool itself need not be.
inline constexpr int kPoolBytes = 1024 - 8;
/// The bytes for a sum of two closures, or for a product of a closure and a number (OSLClosureAdd, OSLClosureMul in
/// kernel/osl/types.h). With a colour, OSL combines closure and product into one (peephole2() in its
/// runtimeoptimize.cpp).
inline constexpr int kPoolNode = 24;
/// The bytes for a closure with its weight.
int pool_bytes(ClosureKind);

}  // namespace brdfc::inline closures
