// SPDX-License-Identifier: GPL-3.0-or-later
// Merging the programs for all combinations of choices into one program for nodes.
#include "forms/node_choices.h"

#include <gtest/gtest.h>

#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/inputs.h"
#include "support.h"
#include "trace/program.h"

namespace brdfc::forms {
namespace {

/// The programs of f for all combinations, merged into one.
Program recorded_value(const Model& m, const ParamValues& fixed) {
  std::vector<Program> by_combination;
  for (const ParamValues& values : open_combinations(m.info(), fixed))
    by_combination.emplace_back().output("f", m.record(values)->eval(input3("wi"), input3("wo")));
  return selected_by_choices(m.info(), fixed, by_combination);
}

TEST(NodeChoices, SelectTheValueOfTheirCombination) {
  for (const char* name : {"ward", "coupled", "oren_nayar", "ashikhmin_shirley", "radziszewski_alda"}) {
    const Model& m = find_model(name);
    ParamValues fixed;  // choices of which nodes support only one option
    if (m.info().param("diffuse")) fixed["diffuse"] = std::string("paper");
    if (m.info().param("around")) fixed["around"] = std::string("reflection");
    Recorder recorder;
    const Program program = recorded_value(m, fixed);
    measure::Random random(3);
    for (const Choices& choices : choice_combinations(m.info())) {
      if (!admits(m.info(), choices, fixed)) continue;
      const ParamValues values = complete(m.info(), with_choices(m.info(), choices));
      const auto brdf = m.make_double(values);
      Inputs<float> inputs;
      set_inputs(inputs, values);
      std::size_t next = 0;
      for (const ParamInfo& p : m.info().params)
        if (p.kind == ParamKind::Choice) set_input(inputs, p.name, choices[next++]);
      for (int i = 0; i < 20; ++i) {
        const Vec3<double> wi = measure::uniform_direction(random), wo = measure::uniform_direction(random);
        set_input(inputs, "wi", wi);
        set_input(inputs, "wo", wo);
        const double expected = brdf->eval(wi, wo).g;
        EXPECT_NEAR(double(program.run<float>(inputs).at("f")[1]), expected, 3e-4 * expected + 1e-6)
            << name << ' ' << format_values(m.info(), values);
      }
    }
  }
}

TEST(NodeChoices, ThatAreFixedAreReadNowhere) {
  const Model& m = find_model("ward");
  Recorder recorder;
  const auto reads = [&](const ParamValues& fixed) {
    for (const std::string& name : recorded_value(m, fixed).inputs())
      if (name == "normalisation") return true;
    return false;
  };
  EXPECT_TRUE(reads({}));
  EXPECT_FALSE(reads({{"normalisation", std::string("duer")}}));
  EXPECT_EQ(open_combinations(m.info(), {{"normalisation", std::string("duer")}}).size(), 1u);
}

}  // namespace
}  // namespace brdfc::forms
