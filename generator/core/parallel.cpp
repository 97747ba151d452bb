// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/parallel.h"

#include <tbb/parallel_for.h>

namespace brdfc::inline core {

void detail::for_all(std::size_t n, void (*call)(const void* f, std::size_t i), const void* f) {
  tbb::task_group_context alone(tbb::task_group_context::isolated);
  tbb::parallel_for(
      std::size_t(0), n, [&](std::size_t i) { call(f, i); }, alone);
}

}  // namespace brdfc::inline core
