// SPDX-License-Identifier: GPL-3.0-or-later
// Statements as data: how a tree is printed, and what can be found in it without printing.
#include "print/statement.h"

#include <gmock/gmock.h>

#include "print/osl_program.h"
#include "print/osl_statements.h"

namespace brdfc::print {
namespace {

using ::testing::Contains;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

/// y = log1p(x) from a table look-up, recorded.
Run recorded(const char* input = "x") {
  Recorder recorder;
  Program program;
  const auto table = make_table("falls", {even_axis("x", 3)}, {1, 0.5, 0});
  const Expr at = named("at", log1p(Expr::input(input)));
  program.output("y", lookup(table, std::array{at}) + at);
  return {std::make_shared<const Program>(std::move(program)), {"taken"}};
}

TEST(Statements, ArePrintedAsOsl) {
  const Statements tree = {
      Comment{"What for."},
      Declare{"float", {{"a", {1.0}}, {"b"}, {"c", {}, 3}, {"d", {0.5, -2.0}, 2}}},
      Array{"knots", {0, 0.25, 1}},
      Gap{},
      Loop{"i", 3, {Assign{element("c", "i"), Value("a") * (Value("b") + 1.0), "+="}}},
      Loop{"i", "n", {If{operation("a", "<", 1.0), {Continue{}}}, Increment{"count"}}, true},
      If{any_of({all_of({operation("a", ">", 0.0), call("is_so")}), operation("b", "==", 0)}),
         {assign("a", choice("so", -1.0, -Value("a")))},
         {Perform{call("get", {quotation("path:\"x\""), "a"})}}},
      Block{{recorded()}},
  };
  const OslText out = osl_statements(tree, 1);
  EXPECT_EQ(out.text, R"(    // What for.
    float a = 1.0, b, c[3], d[2] = {0.5, -2.0};
    float knots[3] = {0.0,.25,1.0};

    for (int i = 0; i < 3; i++)
        c[i] += a * (b + 1.0);
    for (int i = 0; i <= n; i++) {
        if (a < 1.0)
            continue;
        count++;
    }
    if (a > 0.0 && is_so() || b == 0) {
        a = so ? -1.0 : -a;
    } else {
        get("path:\"x\"", a);
    }
    {
        float at = brdfc_log1p(x);
        y = brdfc_table1(falls, 3, 2.0 * clamp(at, 0.0, 1.0)) + at;
    }
)");
  EXPECT_EQ(out.statements, std::count(out.text.begin(), out.text.end(), ';') - 2 * 2) << "without those of two loops";
}

TEST(Statements, KeepTheGroupingOfTheirValues) {
  const Value a = "a", b = "b", c = "c";
  EXPECT_EQ(osl_value(a + b + c), "a + b + c");
  EXPECT_EQ(osl_value(a + (b + c)), "a + (b + c)");
  EXPECT_EQ(osl_value((a + b) * c), "(a + b) * c");
  EXPECT_EQ(osl_value(a * -(b + c)), "a * -(b + c)");
  EXPECT_EQ(osl_value(!operation(a, "<", b)), "!(a < b)");
  EXPECT_EQ(osl_value(!call("is_so")), "!is_so()");
  EXPECT_EQ(osl_value(operation(a, "-", operation(b, "-", c))), "a - (b - c)");
  EXPECT_EQ(osl_value(operation(a * b, "/", c * c)), "a * b / (c * c)");
  EXPECT_EQ(osl_value(all_of({any_of({a, b}), c})), "(a || b) && c");
  EXPECT_EQ(osl_value(element(element("shape", "lamp"), 0)), "shape[lamp][0]");
  EXPECT_EQ(osl_value(element(a + b, 1)), "(a + b)[1]");
  EXPECT_EQ(osl_value(choice(choice(a, b, c), a, b)), "(a ? b : c) ? a : b");
}

/// Of the parameters, those that a shader reads have to be clamped to their ranges.
TEST(Statements, TellWhatTheyReadAndCall) {
  const Statements tree = {
      Comment{"Neither this word nor that."},
      declare("float", "declared", call("max", {"e", 0.0})),
      Cases{{{operation("part", "==", 0), {recorded("roughness")}}, {"never", {Perform{call("brdfc_frame", {"n"})}}}}},
      If{operation(quotation("text"), "!=", "type"), {assign(element("ramp", "entry"), 1.0)}},
  };
  EXPECT_THAT(names_in(tree), UnorderedElementsAre("e", "part", "roughness", "n", "type", "ramp", "entry"));
  EXPECT_THAT(functions_in(tree), UnorderedElementsAre("max", "brdfc_frame", "brdfc_log1p", "brdfc_table1"));
  // Occurrences in longer names, comments, texts or the condition of the last case are not reads.
  EXPECT_THAT(names_in({declare("float", "rough", "roughness_2")}), Not(Contains("roughness")));
}

TEST(Statements, AreEqualIfTheyDoTheSame) {
  const auto tree = [](const char* input, double number) {
    return Statements{Block{{If{operation("a", "<", number), {recorded(input)}}}}};
  };
  EXPECT_TRUE(tree("x", 1) == tree("x", 1)) << "recorded twice";
  EXPECT_FALSE(tree("x", 1) == tree("z", 1));
  EXPECT_FALSE(tree("x", 1) == tree("x", 2));
  EXPECT_FALSE(Statements{Gap{}} == Statements{Continue{}});
}

TEST(Statements, OfNothingAreNoBlock) {
  EXPECT_TRUE(scope({}).empty());
  EXPECT_EQ(osl_statements(scope({assign("a", 1)}), 0).text, "{\n    a = 1;\n}\n");
}

TEST(Statements, NameTheArraysOfAProgramAsItsStatementsDo) {
  const auto run = recorded();
  const std::vector<ProgramArray> arrays = osl_arrays(*run.program, {"falls"});
  ASSERT_EQ(arrays.size(), 1u);
  EXPECT_EQ(arrays[0].name, "falls_1");
  EXPECT_EQ(arrays[0].table->values, (std::vector<double>{1, 0.5, 0}));
  EXPECT_THAT(osl_assignments(*run.program, 0, {"falls"}).text, testing::HasSubstr("brdfc_table1(falls_1, 3,"));
}

}  // namespace
}  // namespace brdfc::print
