// SPDX-License-Identifier: GPL-3.0-or-later
// Loops over all cores.
#pragma once

#include <tbb/parallel_for.h>

#include <cstddef>

namespace brdfc::inline core {

/// f(i) for i from 0 to n - 1, side by side. What one of them throws is thrown here, once those that had begun are
/// done; loops within these come to their end. TBB's own would stop where a loop around them was cancelled, without a
/// word to whoever goes on with their results.
template <class F> void for_all(std::size_t n, const F& f) {
  tbb::task_group_context alone(tbb::task_group_context::isolated);
  tbb::parallel_for(std::size_t(0), n, f, alone);
}

}  // namespace brdfc::inline core
