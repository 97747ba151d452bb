// SPDX-License-Identifier: GPL-3.0-or-later
// Parallel loops.
#pragma once

#include <tbb/parallel_for.h>

#include <cstddef>

namespace brdfc::inline core {

/// Calls f(i) for i from 0 to n - 1, in parallel. If a call throws, the exception is rethrown here once the calls that
/// had begun are done. A nested loop always finishes. TBB by itself would stop it when the enclosing loop is cancelled,
/// without telling the caller that the results are incomplete.
template <class F> void for_all(std::size_t n, const F& f) {
  tbb::task_group_context alone(tbb::task_group_context::isolated);
  tbb::parallel_for(std::size_t(0), n, f, alone);
}

}  // namespace brdfc::inline core
