// SPDX-License-Identifier: GPL-3.0-or-later
// How a schema describes its numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "model/model.h"

namespace brdfc {
namespace {

ParamInfo number(double min, double max, bool by_factors) {
  ParamInfo p;
  p.min = p.soft_min = min;
  p.max = p.soft_max = max;
  p.by_factors = by_factors;
  return p;
}

TEST(Schema, ANumberIsSteppedThroughAsItDeclares) {
  EXPECT_EQ(number(1, 1e4, false).accepted().at(0.5), 5000.5);
  EXPECT_DOUBLE_EQ(number(1, 1e4, true).accepted().at(0.5), 100);
  EXPECT_DOUBLE_EQ(number(0, 99, true).accepted().at(0.5), 9) << "1 + x goes by factors where x begins at 0";
  EXPECT_DOUBLE_EQ(number(0, 1, true).accepted().at(0.5), 0.5) << "which means nothing below 1";
  for (const double t : {0.0, 1.0}) EXPECT_EQ(number(0.1, 3, true).accepted().at(t), t == 0 ? 0.1 : 3);
}

TEST(Schema, ASliderMayHaveAnotherScaleThanAllThatIsAccepted) {
  const ParamInfo& e = *find_model("phong").info().param("e");
  EXPECT_EQ(e.slider().scale, AxisScale::Log) << "from 1 on";
  EXPECT_EQ(e.accepted().scale, AxisScale::Log1p) << "from 0 on";
  EXPECT_EQ(find_model("coupled").info().param("r0")->accepted().scale, AxisScale::Linear);
}

/// The scale is not derived from the range, so a range over many powers of ten indicates a missing declaration.
TEST(Schema, WideRangesGoByFactors) {
  for (const auto& [name, model] : models())
    for (const ParamInfo& p : model->info().params)
      if (p.kind == ParamKind::Number && (p.max > 1000 || (p.min > 0 && p.max > 1000 * p.min))) {
        EXPECT_TRUE(p.by_factors) << name << " " << p.name;
      }
}

}  // namespace
}  // namespace brdfc
