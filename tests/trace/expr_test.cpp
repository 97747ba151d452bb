// SPDX-License-Identifier: GPL-3.0-or-later
// The recorded scalar: constant folding, sharing, pruning, loops, and errors.
#include "trace/expr.h"

#include <gmock/gmock.h>

#include <random>

#include "forms/form.h"
#include "model/choices.h"
#include "print/osl_program.h"
#include "support.h"
#include "tables/table.h"

namespace brdfc {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Expr, FoldsConstantsInDoublePrecision) {
  Recorder recorder;
  Program program;
  program.output("y", sqrt(Expr(2.0)) * Expr(2.0) + Expr(1.0));
  EXPECT_EQ(program.operations(), 0);
  EXPECT_THAT(print::osl_program(program, 0, {}), HasSubstr("y = 3.828427;"));
}

TEST(Expr, SharesEqualSubexpressions) {
  Recorder recorder;
  Program program;
  const Expr x = Expr::input("x"), y = Expr::input("y");
  program.output("z", exp(x * y) + sin(exp(y * x)));
  EXPECT_EQ(program.operations(), 4);  // product, exp, sin, sum
}

TEST(Expr, AZeroFactorRemovesATerm) {
  Recorder recorder;
  Program program;
  program.output("z", Expr::input("x") + Expr(0.0) * exp(Expr::input("y")));
  EXPECT_EQ(program.operations(), 0);
  EXPECT_EQ(program.inputs(), std::vector<std::string>{"x"});
}

TEST(Expr, OnlyWhatOutputsReachIsPrinted) {
  Recorder recorder;
  Program program;
  const Expr x = Expr::input("x");
  named("unused", exp(x));
  program.output("z", named("used", sin(x)));
  const std::string text = print::osl_program(program, 0, {});
  EXPECT_THAT(text, HasSubstr("float used = sin(x);"));
  EXPECT_THAT(text, Not(HasSubstr("unused")));
}

TEST(Expr, GroupingOfFloatingPointOperationsIsPrinted) {
  Recorder recorder;
  Program program;
  const Expr a = Expr::input("a"), b = Expr::input("b"), c = Expr::input("c");
  program.output("p", a - (b - c));
  program.output("q", (a - b) - c);
  program.output("r", a / (b * c));
  program.output("s", -(a + b));
  const std::string text = print::osl_program(program, 0, {});
  EXPECT_THAT(text, HasSubstr("p = a - (b - c);"));
  EXPECT_THAT(text, HasSubstr("q = a - b - c;"));
  EXPECT_THAT(text, HasSubstr("r = a / (b * c);"));
  EXPECT_THAT(text, HasSubstr("s = -(a + b);"));
}

TEST(Expr, ALoopStaysALoop) {
  Recorder recorder;
  Program program;
  const Expr x = Expr::input("x");
  // Heron's method for square roots.
  const auto result = iterate(5, std::array<Expr, 1>{Expr(1.0)}, [&](const std::array<Expr, 1>& s) {
    return std::array<Expr, 1>{(s[0] + x / s[0]) / Expr(2.0)};
  });
  program.output("root", result[0]);
  const std::string text = print::osl_program(program, 0, {});
  EXPECT_THAT(text, HasSubstr("for (int i = 0; i < 5; i++) {"));
  EXPECT_NEAR(program.run<double>({{"x", {2.0, 2.0, 2.0}}}).at("root")[0], std::sqrt(2.0), 1e-9);
}

TEST(Expr, TwoLoopsWithTheSameBodyStayApart) {
  Recorder recorder;
  Program program;
  const Expr x = Expr::input("x");
  const auto times_x = [&](const std::array<Expr, 1>& s) { return std::array<Expr, 1>{s[0] * x}; };
  program.output("a", iterate(3, std::array<Expr, 1>{Expr(1.0)}, times_x)[0]);
  program.output("b", iterate(3, std::array<Expr, 1>{Expr(2.0)}, times_x)[0]);
  const auto out = program.run<double>({{"x", {2.0, 2.0, 2.0}}});
  EXPECT_EQ(out.at("a")[0], 8);
  EXPECT_EQ(out.at("b")[0], 16);
}

TEST(Expr, ALookUpIsAnArrayAndACall) {
  Recorder recorder;
  Program program;
  const auto table = make_table("grid", {even_axis("x", 2), even_axis("y", 3)}, {0, 1, 4, 10, 11, 14});
  program.output("z", lookup(table, std::array<Expr, 2>{Expr::input("x"), Expr::input("y")}));
  const std::string text = print::osl_program(program, 0, {});
  EXPECT_THAT(text, HasSubstr("float grid[6] = {0.0,1.0,4.0,10.0,11.0,14.0};"));
  EXPECT_THAT(text, HasSubstr("brdfc_table2(grid, 2, 3, 1.0 * clamp(x, 0.0, "
                              "1.0), 2.0 * clamp(y, 0.0, 1.0))"));
  for (const double x : {0.0, 0.3, 1.0, 2.0})
    for (const double y : {-1.0, 0.0, 0.4, 0.9, 1.0}) {
      const double z = program.run<double>({{"x", {x, x, x}}, {"y", {y, y, y}}}).at("z")[0];
      EXPECT_EQ(z, lookup(table, std::array<double, 2>{x, y}));
    }
  EXPECT_DOUBLE_EQ(lookup(table, std::array<double, 2>{0.5, 0.75}), 0.5 * (2.5 + 12.5));
  EXPECT_THROW(make_table("bad", {even_axis("x", 2)}, {0, std::nan("")}), ValueError);
  const auto other = make_table("grid", {even_axis("x", 2)}, {0, 1});
  EXPECT_THROW(lookup(other, std::array<Expr, 2>{Expr::input("x"), Expr::input("y")}), ExprError);
}

TEST(Expr, ALookUpOverFourAxesIsTheSameRecordedAndComputed) {
  Recorder recorder;
  Program program;
  std::vector<double> values;
  for (int i = 0; i < 2 * 3 * 2 * 4; ++i) values.push_back((i * 7) % 11);
  const auto table =
      make_table("grid", {even_axis("x", 2), even_axis("y", 3), even_axis("z", 2), even_axis("w", 4)}, values);
  const char* names[] = {"x", "y", "z", "w"};
  std::array<Expr, 4> inputs;
  for (std::size_t k = 0; k < 4; ++k) inputs[k] = Expr::input(names[k]);
  program.output("v", lookup(table, inputs));
  EXPECT_THAT(print::osl_program(program, 0, {}),
              HasSubstr("brdfc_table4(grid, 2, 3, 2, 4, 1.0 * clamp(x, 0.0, 1.0), 2.0 * "));
  // At a knot, and halfway between two knots on the last axis.
  EXPECT_EQ(lookup(table, std::array<double, 4>{1, 0.5, 0, 2 / 3.}), values[((1 * 3 + 1) * 2 + 0) * 4 + 2]);
  EXPECT_DOUBLE_EQ(lookup(table, std::array<double, 4>{1, 1, 1, 0.5}), 0.5 * (values[45] + values[46]));
  for (const double x : {0., 0.3, 1.7})
    for (const double w : {-1., 0.4, 0.9})
      EXPECT_EQ(
          program.run<double>({{"x", {x, x, x}}, {"y", {0.7, 0.7, 0.7}}, {"z", {0.2, 0.2, 0.2}}, {"w", {w, w, w}}})
              .at("v")[0],
          lookup(table, std::array<double, 4>{x, 0.7, 0.2, w}));
}

TEST(Expr, ColoursDivideByChannel) {
  Recorder recorder;
  Program program;
  program.output("z", Rgb<Expr>::input("a") / Rgb<Expr>::input("b"));
  EXPECT_THAT(print::osl_program(program, 0, {}), HasSubstr("z = a / b;"));
  const auto z = program.run<double>({{"a", {1, 2, 3}}, {"b", {2, 8, 0.5}}}).at("z");
  EXPECT_EQ(z, (std::array<double, 3>{0.5, 0.25, 6}));
}

TEST(Expr, RefusesWhatItCannotExpress) {
  Recorder recorder;
  EXPECT_THROW(log(Expr(0.0)), ExprError);
  EXPECT_THROW(Expr::input("x") / Expr(0.0), ExprError);
  const auto identity = [](const std::array<Expr, 1>& s) { return s; };
  const auto nested = [&](const std::array<Expr, 1>& s) { return iterate(2, s, identity); };
  EXPECT_THROW(iterate(2, std::array<Expr, 1>{Expr::input("x")}, nested), ExprError);
  static_assert(!std::is_convertible_v<Condition, bool>);
}

TEST(Expr, NamesDoNotCollideWithOslOrInputs) {
  Recorder recorder;
  Program program;
  const Expr n = Expr::input("n");
  program.output("z", named("n", exp(n)) + named("N", sin(n)) + named("float", cos(n)));
  const std::string text = print::osl_program(program, 0, {});
  EXPECT_THAT(text, HasSubstr("float n_1 = exp(n);"));
  EXPECT_THAT(text, HasSubstr("float N_1 = sin(n);"));
  EXPECT_THAT(text, HasSubstr("float float_1 = cos(n);"));
}

TEST(Expr, ColoursAreOneNode) {
  Recorder recorder;
  Program program;
  const Rgb<Expr> c = Rgb<Expr>::input("c");
  program.output("z", c + (Rgb<Expr>(Expr(1.0)) - c) * Expr::input("f"));
  EXPECT_THAT(print::osl_program(program, 0, {}), HasSubstr("z = c + (1.0 - c) * f;"));
}

/// Compares every model's recorded eval, pdf and sample, executed in float, with its float instantiation: the same bits
/// except for constants, which the recording folds in double and rounds once.
class RecordedFormula : public ::testing::TestWithParam<std::string> {};

TEST_P(RecordedFormula, ExecutedInFloatEqualsTheFloatInstantiation) {
  const Model& model = find_model(GetParam());
  std::mt19937 rng(7);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  const auto direction = [&] {
    const float z = 0.001f + 0.999f * uniform(rng), r = std::sqrt(1 - z * z), phi = 6.2831853f * uniform(rng);
    return Vec3<float>{r * std::cos(phi), r * std::sin(phi), z};
  };
  for (const Choices& choices : choice_combinations(model.info())) {
    Recorder recorder;
    const auto recorded = model.record(with_choices(model.info(), choices));
    const Vec3<Expr> u = {Expr::input("u_0"), Expr::input("u_1"), Expr::input("u_2")};
    Program program;
    program.output("f", recorded->eval(input3("wi"), input3("wo")));
    program.output("p", recorded->pdf(input3("wi"), input3("wo")));
    program.output("w", recorded->sample(input3("wo"), u).weight);

    double worst = 0;
    for (int i = 0; i < 2000; ++i) {
      ParamValues values = with_choices(model.info(), choices);
      Inputs<float> inputs;
      for (const ParamInfo& p : model.info().params) {
        if (p.kind == ParamKind::Choice) continue;
        std::array<float, 3> v;
        const double scale = p.kind == ParamKind::Color ? 1 : std::min(p.soft_max, 50.0) - p.soft_min;
        for (float& x : v) x = float(p.kind == ParamKind::Color ? 0 : p.soft_min) + float(scale) * uniform(rng);
        if (p.kind == ParamKind::Number) v[1] = v[2] = v[0];
        inputs[p.name] = v;
        if (p.kind == ParamKind::Number)
          values[p.name] = double(v[0]);
        else
          values[p.name] = std::array<double, 3>{v[0], v[1], v[2]};
      }
      const Vec3<float> wi = direction(), wo = direction(), un = {uniform(rng), uniform(rng), uniform(rng)};
      set_input(inputs, "wi", wi);
      set_input(inputs, "wo", wo);
      set_input(inputs, "u_0", un.x);
      set_input(inputs, "u_1", un.y);
      set_input(inputs, "u_2", un.z);
      const auto brdf = model.make_float(values);
      const auto out = program.run<float>(inputs);
      const Rgb<float> f = brdf->eval(wi, wo);
      const float p = brdf->pdf(wi, wo);
      const auto compare = [&](float a, float b) {
        ASSERT_TRUE(std::isfinite(a) && std::isfinite(b)) << model.info().name;
        worst = std::max(worst, std::abs(double(a) - b) / std::max(1e-30, double(std::abs(b))));
      };
      compare(out.at("f")[0], f.r);
      compare(out.at("f")[1], f.g);
      compare(out.at("f")[2], f.b);
      compare(out.at("p")[0], p);
      compare(out.at("w")[0], brdf->sample(wo, un).weight.r);
    }
    // The exponent, 50 here, may amplify the rounding of a constant. thin_film's reflectance is a difference from 1,
    // which is 0.005 in some of these cases.
    EXPECT_LT(worst, model.info().name == "thin_film" ? 2e-4 : 2e-5) << model.info().name;
  }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, RecordedFormula, ::testing::ValuesIn(model_names()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace brdfc
