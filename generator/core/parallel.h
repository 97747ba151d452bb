// SPDX-License-Identifier: GPL-3.0-or-later
// Parallel loops. TBB's headers are left to the one source that calls it: they take a second in each that includes
// them.
#pragma once

#include <cstddef>

namespace brdfc::inline core {

namespace detail {

void for_all(std::size_t n, void (*call)(const void* f, std::size_t i), const void* f);

}  // namespace detail

/// Calls f(i) for i from 0 to n - 1, in parallel. If a call throws, the exception is rethrown here once the calls that
/// had begun are done. A nested loop always finishes. TBB by itself would stop it when the enclosing loop is cancelled,
/// without telling the caller that the results are incomplete.
template <class F> void for_all(std::size_t n, const F& f) {
  detail::for_all(
      n, [](const void* g, std::size_t i) { (*static_cast<const F*>(g))(i); }, &f);
}

}  // namespace brdfc::inline core
