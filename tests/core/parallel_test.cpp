// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/parallel.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <thread>
#include <vector>

namespace brdfc {
namespace {

TEST(ForAll, DoesEachOnce) {
  std::vector<int> done(1000, 0);
  for_all(done.size(), [&](std::size_t i) { ++done[i]; });
  EXPECT_EQ(done, std::vector<int>(1000, 1));
  for_all(0, [](std::size_t) { FAIL(); });
}

TEST(ForAll, ThrowsWhatOneThrows) {
  EXPECT_THROW(for_all(100,
                       [](std::size_t i) {
                         if (i == 60) throw std::runtime_error("60");
                       }),
               std::runtime_error);
}

/// Otherwise the code after an inner loop would find its results incomplete.
TEST(ForAll, EndsWhatIsWithinOneThatIsLeft) {
  constexpr std::size_t kOuter = 4, kInner = 200;
  for (int round = 0; round < 20; ++round) {
    std::atomic<int> halves = 0;
    EXPECT_THROW(for_all(kOuter,
                         [&](std::size_t i) {
                           if (i == 0) throw std::runtime_error("left");
                           std::atomic<std::size_t> done = 0;
                           for_all(kInner, [&](std::size_t) {
                             std::this_thread::yield();
                             ++done;
                           });
                           if (done != kInner) ++halves;
                         }),
                 std::runtime_error);
    EXPECT_EQ(halves, 0);
  }
}

}  // namespace
}  // namespace brdfc
