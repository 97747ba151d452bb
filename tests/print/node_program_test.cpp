// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as Blender's nodes: evaluated as in Cycles' SVM, it gives the same result as the recording.
#include "print/node_program.h"

#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <random>

#include "measure/probes.h"
#include "model/choices.h"
#include "model/inputs.h"
#include "model/model.h"
#include "model/sampling.h"

namespace brdfc::print {
namespace {

using NodeValue = std::array<float, 3>;
using NodeValues = std::map<std::string, NodeValue>;

/// One operation, as in kernel/svm/math_util.h and mix.h.
NodeValue compute(const NodeOperation& o, const std::vector<NodeValue>& a) {
  const auto each = [&](const auto& f) { return NodeValue{f(0), f(1), f(2)}; };
  const auto grey = [](float x) { return NodeValue{x, x, x}; };
  const std::string kind = o.kind.starts_with("V_") ? o.kind.substr(2) : o.kind;
  if (kind == "COMBINE") return {a[0][0], a[1][0], a[2][0]};
  if (kind == "X" || kind == "Y" || kind == "Z") return grey(a[0][std::size_t(kind[0] - 'X')]);
  if (kind == "LOOKUP") {
    std::vector<float> at;
    for (const NodeValue& x : a) at.push_back(x[0]);
    return grey(lookup(o.table, at));
  }
  if (kind == "DOT_PRODUCT") return grey(a[0][0] * a[1][0] + a[0][1] * a[1][1] + a[0][2] * a[1][2]);
  return each([&](std::size_t c) -> float {
    const float x = a[0][c], y = a.size() > 1 ? a[1][c] : 0, z = a.size() > 2 ? a[2][c] : 0;
    if (kind == "ADD") return x + y;
    if (kind == "SUBTRACT") return x - y;
    if (kind == "MULTIPLY" || kind == "SCALE") return x * y;
    if (kind == "MULTIPLY_ADD") return x * y + z;
    if (kind == "DIVIDE") return y != 0 ? x / y : 0;
    if (kind == "SQRT") return std::sqrt(std::max(x, 0.f));
    if (kind == "EXPONENT") return std::exp(x);
    if (kind == "LOGARITHM") return x <= 0 || y <= 0 ? 0 : std::log(x) / std::log(y);
    if (kind == "SINE") return std::sin(x);
    if (kind == "COSINE") return std::cos(x);
    if (kind == "ARCTANGENT") return std::atan(x);
    if (kind == "POWER") return x < 0 && y != std::floor(y) ? 0 : std::pow(x, y);
    if (kind == "ABSOLUTE") return std::abs(x);
    if (kind == "MINIMUM") return std::fmin(x, y);
    if (kind == "MAXIMUM") return std::fmax(x, y);
    if (kind == "LESS_THAN") return x < y;
    if (kind == "MIX") return y * (1 - x) + z * x;
    ADD_FAILURE() << "no node " << o.kind;
    return 0;
  });
}

NodeValues run(const NodeProgram& program, const NodeValues& inputs) {
  std::vector<NodeValue> results;
  const auto value = [&](const NodeOperand& o) {
    if (o.result >= 0) return results.at(std::size_t(o.result));
    if (!o.input.empty()) return inputs.at(o.input);
    return NodeValue{float(o.value[0]), float(o.value[1]), float(o.value[2])};
  };
  for (const NodeOperation& o : program.operations) {
    std::vector<NodeValue> arguments;
    for (const NodeOperand& a : o.operands) arguments.push_back(value(a));
    results.push_back(compute(o, arguments));
  }
  NodeValues out;
  for (const auto& [name, o] : program.outputs) out[name] = value(o);
  return out;
}

NodeProgram program_of(const Expr& value) {
  Program program;
  program.output("y", value);
  return node_program(program);
}
float run_one(const NodeProgram& program, const std::map<std::string, float>& inputs) {
  NodeValues values;
  for (const auto& [name, x] : inputs) values[name] = {x, x, x};
  return run(program, values).at("y")[0];
}

TEST(NodeProgram, WhatNodesLackIsMadeOfWhatTheyHave) {
  Recorder recorder;
  const Expr x = Expr::input("x");
  const NodeProgram expm1_of = program_of(expm1(x)), log1p_of = program_of(log1p(x)), cbrt_of = program_of(cbrt(x));
  for (const float at : {-0.9f, -0.41f, -0.3f, -1e-5f, 1e-7f, 0.1f, 0.39f, 0.7f, 20.f}) {
    EXPECT_NEAR(run_one(expm1_of, {{"x", at}}) / std::expm1(double(at)), 1, 4e-7) << at;
    EXPECT_NEAR(run_one(log1p_of, {{"x", at}}) / std::log1p(double(at)), 1, 4e-7) << at;
    EXPECT_NEAR(run_one(cbrt_of, {{"x", at}}) / std::cbrt(double(at)), 1, 4e-7) << at;
  }
}

TEST(NodeProgram, TruthValuesAndSelections) {
  Recorder recorder;
  const Expr a = Expr::input("a"), b = Expr::input("b");
  const auto value = [](const Condition& c) { return program_of(select(c, Expr(3.0), Expr::input("c"))); };
  const std::map<std::string, std::pair<NodeProgram, bool (*)(float, float)>> cases = {
      {"less", {value(a < b), [](float x, float y) { return x < y; }}},
      {"at most", {value(a <= b), [](float x, float y) { return x <= y; }}},
      {"not", {value(!(a <= b)), [](float x, float y) { return x > y; }}},
      {"both", {value(a <= b && b <= Expr(1.0)), [](float x, float y) { return x <= y && y <= 1; }}},
      {"mixed", {value(a <= b && b < Expr(1.0)), [](float x, float y) { return x <= y && y < 1; }}},
      {"either", {value(a <= b || b <= Expr(1.0)), [](float x, float y) { return x <= y || y <= 1; }}},
      {"other", {value(!(a < b || b <= Expr(1.0))), [](float x, float y) { return !(x < y || y <= 1); }}}};
  for (const auto& [name, c] : cases)
    for (const float x : {0.f, 1.f, 2.f})
      for (const float y : {0.f, 1.f, 2.f})
        EXPECT_EQ(run_one(c.first, {{"a", x}, {"b", y}, {"c", 7}}), c.second(x, y) ? 3 : 7) << name << x << y;
}

TEST(NodeProgram, LoopsAreUnrolledAndProductsAddedInOneNode) {
  Recorder recorder;
  const Expr x = Expr::input("x");
  const NodeProgram program = program_of(iterate(3, std::array<Expr, 1>{x}, [&](const std::array<Expr, 1>& s) {
    return std::array<Expr, 1>{s[0] * x + Expr(1.0)};
  })[0]);
  ASSERT_EQ(program.operations.size(), 3u);
  for (const NodeOperation& o : program.operations) EXPECT_EQ(o.kind, "MULTIPLY_ADD");
  EXPECT_EQ(run_one(program, {{"x", 2}}), 2 * 2 * 2 * 2 + 4 + 2 + 1);
  EXPECT_EQ(program.live, 2);
}

TEST(NodeProgram, WhatDoesNotVaryIsComputedOnce) {
  Recorder recorder;
  const Expr a = Expr::input("a"), x = Expr::input("x");
  Program program;
  program.output("y", exp(a * a) * x + sqrt(a));
  program.output("z", exp(a * a) - x);
  program.output("left_out", x * sin(a));
  const NodePrograms made = node_programs(program, {"x"}, "kept_", {{"y"}, {"y", "z"}});
  ASSERT_EQ(made.each.size(), 2u);
  EXPECT_EQ(made.each[0].operations.size(), 1u);
  EXPECT_EQ(made.each[1].operations.size(), 2u);
  NodeValues values = run(made.once, {{"a", {2, 2, 2}}});
  EXPECT_EQ(values.size(), 3u);
  values["x"] = {3, 3, 3};
  EXPECT_FLOAT_EQ(run(made.each[0], values).at("y")[0], std::exp(4.f) * 3 + std::sqrt(2.f));
  const NodeValues both = run(made.each[1], values);
  EXPECT_EQ(both.size(), 2u);
  EXPECT_FLOAT_EQ(both.at("z")[0], std::exp(4.f) - 3);
}

/// For every model, values and samples of nodes are finite and equal those of the recording in single precision. The
/// weight of a sample is the value divided by the pdf: as nodes have no other one.
class NodesOfModels : public ::testing::TestWithParam<std::string> {};

TEST_P(NodesOfModels, AreTheRecording) {
  const Model& model = find_model(GetParam());
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto direction_at = [&](double height) { return direction(height, 2 * kPi * unit(random)); };
  for (const Choices& choices : choice_combinations(model.info())) {
    const ParamValues chosen = with_choices(model.info(), choices);
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> brdf = model.record(chosen);
    if (!model.has_scatter() || measure::two_sided(model, *brdf)) continue;
    const Vec3<Expr> wi = input3("wi"), wo = input3("wo");
    Program program;
    program.output("value", brdf->eval(wi, wo) * abs(wi.z));
    program.output("pdf", brdf->pdf(wi, wo));
    const Sample<Expr> s = brdf->sample(wo, {Expr::input("u_0"), Expr::input("u_1"), Expr::input("u_2")});
    program.output("drawn", s.wi);
    program.output("weight", s.weight);
    const NodePrograms nodes =
        node_programs(program, {"wi_x", "wi_y", "wi_z", "u_0", "u_1", "u_2"}, "kept_",
                      {{"value", "pdf"}, {"drawn_x", "drawn_y", "drawn_z"}}, {"wi", "wo", "drawn"});
    for (const NodeProgram& each : nodes.each) EXPECT_LT(each.live + int(nodes.once.outputs.size()), kSvmStack);
    for (int trial = 0; trial < 100; ++trial) {
      // At the ends of ranges values may be as large as squared rounding errors are small, so the weight alone counts.
      const bool stiff = trial % 8 == 5;
      ParamValues values = chosen;
      if (trial % 2 == 1 && model.info().name != "lossless")
        for (const ParamInfo& p : model.info().params) {
          const auto anywhere = [&] {
            if (stiff) return unit(random) < 0.5 ? p.min : std::min(p.max, 1e6);
            return p.soft_min + sqr(unit(random)) * (p.soft_max - p.soft_min);
          };
          if (p.kind == ParamKind::Number) values[p.name] = anywhere();
          if (p.kind == ParamKind::Color)
            values[p.name] = std::array<double, 3>{unit(random), unit(random), unit(random)};
        }
      Inputs<float> inputs;
      set_inputs(inputs, with_choices(model.info(), choices, complete(model.info(), values)));
      const Vec3<double> out = direction_at(0.02 + 0.98 * unit(random));
      set_input(inputs, "wo", out);
      // Every second one near the highlight.
      Vec3<double> in = direction_at(trial % 4 < 2 ? 0.02 + 0.98 * unit(random) : out.z);
      if (trial % 4 == 3) in = normalize(Vec3<double>{-out.x, -out.y, out.z} + direction_at(0.5) * 0.05);
      set_input(inputs, "wi", in);
      for (const char* u : {"u_0", "u_1", "u_2"}) set_input(inputs, u, unit(random));
      const auto expected = program.run(inputs);
      NodeValues given(inputs.begin(), inputs.end());
      for (const char* name : {"wi", "wo"})
        for (std::size_t c = 0; c < 3; ++c) given[name][c] = given.at(std::string(name) + "_" + "xyz"[c])[0];
      given.merge(run(nodes.once, given));
      NodeValues found = run(nodes.each[0], given);
      found.merge(run(nodes.each[1], given));
      given["wi"] = found.at("drawn");
      const NodeValues there = run(nodes.each[0], given);
      for (std::size_t c = 0; c < 3; ++c)
        found["weight"][c] = there.at("pdf")[0] == 0 ? 0 : there.at("value")[c] / there.at("pdf")[0];
      for (std::size_t c = 0; c < 3; ++c) {
        const float x = found.at("drawn")[c];
        found[std::string("drawn_") + "xyz"[c]] = {x, x, x};
      }
      for (const auto& [name, value] : expected)
        for (std::size_t c = 0; c < 3; ++c) {
          const float scale = std::max(std::abs(value[c]), name == "value" ? 1e-5f : 1e-3f);
          EXPECT_TRUE(std::isfinite(found.at(name)[c])) << name << " of " << format_values(model.info(), values);
          if (stiff && name != "weight") continue;
          // Series and products with reciprocals round differently, and powers amplify that.
          EXPECT_NEAR(found.at(name)[c] / scale, value[c] / scale, 2e-3)
              << name << " of " << format_values(model.info(), values) << " " << in.x << " " << in.y << " " << in.z
              << " / " << out.x << " " << out.y << " " << out.z;
        }
    }
  }
}

std::vector<std::string> model_names() {
  std::vector<std::string> names;
  for (const auto& [name, model] : models()) names.push_back(name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(All, NodesOfModels, ::testing::ValuesIn(model_names()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace brdfc::print
