// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/text.h"

#include <gtest/gtest.h>

namespace brdfc {
namespace {

TEST(InPercent, HasTwoDigitsAndNoExponentOfHundreds) {
  EXPECT_EQ(in_percent(0.0025), "0.25");
  EXPECT_EQ(in_percent(0.123), "12");
  EXPECT_EQ(in_percent(0.994), "99");
  EXPECT_EQ(in_percent(0.996), "100");
  EXPECT_EQ(in_percent(12.3), "1230");
  EXPECT_EQ(in_percent(0), "0");
}

}  // namespace
}  // namespace brdfc
