// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as Python: digits, grouping, loops, tables, and errors for names that Python can't have.
#include "print/numpy.h"

#include <gmock/gmock.h>

#include "print/osl_program.h"
#include "tables/table.h"

namespace brdfc::print {
namespace {

using ::testing::HasSubstr;

std::string printed_numpy(const Expr& value, const std::vector<std::string>& arguments) {
  Program program;
  program.output("y", value);
  Tables tables;
  return numpy_function(program, "f", arguments, tables);
}

TEST(NumPy, ConstantsKeepTheDigitsOfADouble) {
  Recorder recorder(Precision::Double);
  EXPECT_EQ(printed_numpy(Expr::input("x") * sqrt(Expr(2.0)), {"x"}),
            "def f(np, x):\n    return x * 1.4142135623730951\n");
}

TEST(NumPy, GroupingSurvives) {
  Recorder recorder(Precision::Double);
  const Expr a = Expr::input("a"), b = Expr::input("b"), c = Expr::input("c");
  EXPECT_THAT(printed_numpy(a - (b - c) / (a * (b / c)), {"a", "b", "c"}), HasSubstr("a - (b - c) / (a * (b / c))"));
  EXPECT_THAT(printed_numpy(select(a < b && !(b <= c), -(a + b), c), {"a", "b", "c"}),
              HasSubstr("np.where((a < b) & np.logical_not(b <= c), -(a + b), c)"));
}

TEST(NumPy, AnIterationStaysALoopOfTheStepsOfItsPrecision) {
  const auto text = [](Precision precision) {
    Recorder recorder(precision);
    const Expr x = Expr::input("x");
    return printed_numpy(iterate(newton_steps<Expr>(), std::array<Expr, 1>{x},
                                 [&](const std::array<Expr, 1>& s) {
                                   return std::array<Expr, 1>{s[0] - (s[0] * s[0] - x) / (s[0] + s[0])};
                                 })[0],
                         {"x"});
  };
  EXPECT_EQ(text(Precision::Double),
            "def f(np, x):\n    x0 = x\n    for i in range(24):\n        next0 = x0 - (x0 * x0 - x) / (x0 + x0)\n"
            "        x0 = next0\n    return x0\n");
  EXPECT_THAT(text(Precision::Single), HasSubstr("range(10)"));
}

TEST(NumPy, ColoursAndTables) {
  Recorder recorder(Precision::Double);
  const auto table = make_table("t", {even_axis("x", 2), even_axis("y", 2)}, {0, 1.0 / 3, 2, 1e-20});
  const Expr x = Expr::input("x");
  Program program;
  program.output("c", Rgb<Expr>::input("k") * Rgb<Expr>(x, Expr(0.5), Expr(1.0)));
  program.output("m", lookup(table, std::array<Expr, 2>{x, max_component(Rgb<Expr>::input("k"))}));
  Tables tables;
  EXPECT_EQ(numpy_function(program, "f", {"x", "k"}, tables),
            "def f(np, x, k):\n    return k * np.rgb(x, 0.5, 1.0), np.lookup(table_t, x, np.max(k, axis=0))\n");
  EXPECT_EQ(tables.at("t"), table);
  EXPECT_EQ(numpy_table(*table), "table_t = table((2, 2), \"\"\"\n0 0.3333333333333333 2 1e-20\n\"\"\")\n");
  const auto other = make_table("t", {even_axis("x", 2)}, {0, 1});
  tables["t"] = other;
  EXPECT_THROW(numpy_function(program, "f", {"x", "k"}, tables), ExprError);
}

TEST(NumPy, WordsOfPythonAreNoNames) {
  Recorder recorder(Precision::Double);
  const Expr x = Expr::input("x");
  const Expr lambda = named("lambda", x * x), np = named("np", exp(lambda)), table = named("table_t", np + lambda);
  EXPECT_EQ(printed_numpy(table * np, {"x"}),
            "def f(np, x):\n    lambda_1 = x * x\n    np_1 = np.exp(lambda_1)\n    model_table_t = np_1 + lambda_1\n"
            "    return model_table_t * np_1\n");
  EXPECT_THROW(printed_numpy(x, {"x", "lambda"}), ExprError);
}

TEST(NumPy, TextIsEscapedAndBroken) {
  EXPECT_EQ(python_string("a \"b\" \\c"), "\"a \\\"b\\\" \\\\c\"");
  EXPECT_EQ(python_number(1), "1.0");
  EXPECT_THROW(python_number(1.0 / 0.0), ExprError);
  EXPECT_EQ(python_docstring({"One line."}, 4), "\"\"\"One line.\"\"\"\n");
  const std::string text = python_docstring({std::string(60, 'a') + " " + std::string(60, 'b'), "c"}, 2);
  EXPECT_EQ(text, "\"\"\"" + std::string(60, 'a') + "\n  " + std::string(60, 'b') + "\n\n  c\n  \"\"\"\n");
}

}  // namespace
}  // namespace brdfc::print
