// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as GLSL: types, grouping, loops, tables, and names that GLSL can't have.
#include "print/glsl.h"

#include <gmock/gmock.h>

#include "tables/table.h"

namespace brdfc::print {
namespace {

using ::testing::HasSubstr;

constexpr ExprType kReal = ExprType::Real, kColor = ExprType::Color;

std::string printed_glsl(const Expr& value, const std::vector<std::string>& names) {
  Program program;
  program.output("y", value);
  std::vector<GlslArgument> arguments;
  for (const std::string& name : names) arguments.push_back({name, kReal});
  Tables tables;
  return glsl_function(program, "f", arguments, {kReal}, tables);
}

TEST(Glsl, NumbersAreFloats) {
  Recorder recorder;
  EXPECT_EQ(printed_glsl(Expr::input("x") * Expr(2) + sqrt(Expr(2.0)), {"x"}),
            "float f(float x) {\n    return x * 2.0 + 1.4142135;\n}\n");
  EXPECT_THROW(printed_glsl(Expr::input("x") * Expr(1e300), {"x"}), ExprError);
}

TEST(Glsl, GroupingSurvives) {
  Recorder recorder;
  const Expr a = Expr::input("a"), b = Expr::input("b"), c = Expr::input("c");
  EXPECT_THAT(printed_glsl(a - (b - c) / (a * (b / c)), {"a", "b", "c"}), HasSubstr("a - (b - c) / (a * (b / c))"));
  EXPECT_THAT(printed_glsl(select((a < b || c < b) && !(b <= c), -(a + b), c), {"a", "b", "c"}),
              HasSubstr("brdfc_select((a < b || c < b) && !(b <= c), -(a + b), c)"));
  // "--" would be a decrement.
  EXPECT_THAT(printed_glsl(a - (-b) * Expr(-2), {"a", "b"}), ::testing::Not(HasSubstr("--")));
}

TEST(Glsl, AnIterationStaysALoopOfTheStepsOfAFloat) {
  Recorder recorder;
  const Expr x = Expr::input("x");
  EXPECT_EQ(printed_glsl(iterate(newton_steps<Expr>(), std::array<Expr, 1>{x},
                                 [&](const std::array<Expr, 1>& s) {
                                   return std::array<Expr, 1>{s[0] - (s[0] * s[0] - x) / (s[0] + s[0])};
                                 })[0],
                         {"x"}),
            "float f(float x) {\n    float x0 = x;\n    for (int i = 0; i < 10; i++) {\n"
            "        float next0 = x0 - (x0 * x0 - x) / (x0 + x0);\n        x0 = next0;\n    }\n    return x0;\n}\n");
}

TEST(Glsl, ColoursTablesAndSeveralResults) {
  Recorder recorder;
  const auto table = make_table("t", {even_axis("x", 2), even_axis("y", 3)}, {0, 1, 2, 3, 4, 5});
  const Expr x = Expr::input("x");
  Program program;
  program.output("c", Rgb<Expr>::input("k") * Rgb<Expr>(x, Expr(0.5), Expr(1.0)));
  program.output("m", lookup(table, std::array<Expr, 2>{x, max_component(Rgb<Expr>::input("k"))}));
  program.output("grey", x);
  Tables tables;
  const std::vector<GlslArgument> arguments = {{"x", kReal}, {"k", kColor}};
  EXPECT_EQ(glsl_function(program, "f", arguments, {kColor, kReal, kColor}, tables),
            "void f(float x, vec3 k, out vec3 c, out float m, out vec3 grey) {\n    c = k * vec3(x, 0.5, 1.0);\n"
            "    m = brdfc_table2(table_t, 2, 3, x, brdfc_max_component(k));\n    grey = vec3(x);\n}\n");
  EXPECT_EQ(tables.at("t"), table);
  EXPECT_THROW(glsl_function(program, "f", arguments, {kColor}, tables), ExprError);
  tables["t"] = make_table("t", {even_axis("x", 2)}, {0, 1});
  EXPECT_THROW(glsl_function(program, "f", arguments, {kColor, kReal, kColor}, tables), ExprError);
}

TEST(Glsl, BothArmsOfASelectionHaveOneType) {
  Recorder recorder;
  Program program;
  const Expr x = Expr::input("x");
  program.output("c", select(x < Expr(0.5), Rgb<Expr>::input("k"), Rgb<Expr>(x)));
  Tables tables;
  EXPECT_THAT(glsl_function(program, "f", {{"x", kReal}, {"k", kColor}}, {kColor}, tables),
              HasSubstr("return brdfc_select(x < 0.5, k, vec3(x));"));
}

TEST(Glsl, WordsOfGlslAreNoNames) {
  Recorder recorder;
  const Expr x = Expr::input("x");
  const Expr half = named("half", x * x), table = named("table_t", exp(half) + half);
  EXPECT_EQ(printed_glsl(table * half, {"x"}),
            "float f(float x) {\n    float half_1 = x * x;\n    float model_table_t = brdfc_exp(half_1) + half_1;\n"
            "    return model_table_t * half_1;\n}\n");
  EXPECT_EQ(printed_glsl(Expr::input("sample"), {"sample"}), "float f(float sample_) {\n    return sample_;\n}\n");
  for (const char* word : {"vec3", "gl_Position", "a__b", "brdfc_exp"}) EXPECT_TRUE(is_glsl_word(word)) << word;
}

}  // namespace
}  // namespace brdfc::print
