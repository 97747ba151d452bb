// SPDX-License-Identifier: GPL-3.0-or-later
// Which cases script/test chooses of those of a test that takes long.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "environment.h"
#include "support.h"

namespace brdfc {
namespace {

const std::vector<std::string> kCases = {"a1", "a2", "a3", "a4", "a5", "b1", "b2", "c1"};

TEST(ThirdOf, IsAllWithoutACommitAndInEvidence) {
  {
    const Environment cell("BRDFC_CELL", nullptr), evidence("BRDFC_EVIDENCE", nullptr);
    EXPECT_EQ(third_of(kCases), kCases);
  }
  const Environment cell("BRDFC_CELL", "x"), evidence("BRDFC_EVIDENCE", "all");
  EXPECT_EQ(third_of(kCases), kCases);
}

TEST(ThirdOf, IsAnotherAtOtherCommitsAndHasOneOfEachKind) {
  const Environment evidence("BRDFC_EVIDENCE", nullptr);
  const auto kind = [](const std::string& name) { return name.substr(0, 1); };
  std::set<std::string> plain, by_kind;
  for (const char* commit : {"a", "b", "c", "d", "e", "f", "g", "h", "i", "j", "k", "l", "m", "n", "o", "p"}) {
    const Environment cell("BRDFC_CELL", commit);
    const auto third = third_of(kCases), of_kinds = third_of(kCases, kind);
    EXPECT_EQ(third, third_of(kCases)) << "the same again for one";
    EXPECT_THAT(third.size(), testing::AllOf(testing::Ge(2u), testing::Le(3u)));
    EXPECT_LE(of_kinds.size(), 4u);
    std::set<std::string> kinds;
    for (const std::string& name : of_kinds) kinds.insert(kind(name));
    EXPECT_EQ(kinds.size(), 3u) << commit;
    plain.insert(third.begin(), third.end());
    by_kind.insert(of_kinds.begin(), of_kinds.end());
  }
  const std::set<std::string> all(kCases.begin(), kCases.end());
  EXPECT_EQ(plain, all);
  EXPECT_EQ(by_kind, all);
}

}  // namespace
}  // namespace brdfc
