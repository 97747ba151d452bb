// SPDX-License-Identifier: GPL-3.0-or-later
// A program owns its recorded nodes.
#include "trace/program.h"

#include <gmock/gmock.h>

#include "print/numpy.h"
#include "print/osl_program.h"

namespace brdfc {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// x^2 + 3, recorded after `unread` other operations that no output depends on.
Program squared(const char* name, int unread = 0) {
  const Expr x = Expr::input("x");
  Expr other = x;
  for (int i = 0; i < unread; ++i) other = sin(other);
  Program program;
  program.output("y", named(name, x * x) + 3.0);
  return program;
}

TEST(Program, OutlivesItsRecorder) {
  Program program;
  std::string osl;
  std::map<std::string, std::array<double, 3>> values;
  {
    Recorder recorder;
    const auto next = iterate(3, std::array<Expr, 1>{Expr::input("x")},
                              [](const std::array<Expr, 1>& s) { return std::array<Expr, 1>{s[0] * s[0] + 1.0}; });
    program.output("y", next[0] * Expr::input("scale"));
    osl = print::osl_program(program, 0, {});
    values = program.run<double>({{"x", {2, 2, 2}}, {"scale", {3, 3, 3}}});
  }
  Recorder another;
  const Expr unrelated = sqrt(Expr::input("z"));
  EXPECT_EQ(print::osl_program(program, 0, {}), osl);
  EXPECT_THAT(osl, HasSubstr("y = x0 * scale;"));
  EXPECT_EQ(program.run<double>({{"x", {2, 2, 2}}, {"scale", {3, 3, 3}}}), values);
  EXPECT_EQ(values.at("y")[0], 3 * 677.0);
  EXPECT_THAT(program.inputs(), ElementsAre("x", "scale"));
  print::Tables tables;
  EXPECT_THAT(print::numpy_function(program, "f", {"x", "scale"}, tables), HasSubstr("return x0 * scale"));
  EXPECT_FALSE(unrelated.is_literal());
}

TEST(Program, IsOfOneRecorder) {
  Recorder recorder;
  Program program;
  program.output("a", Expr::input("x"));
  Recorder another;
  EXPECT_THROW(program.output("b", Expr::input("y")), ExprError);
}

TEST(Program, DoesNotChangeWhileItsRecorderGoesOn) {
  Recorder recorder;
  const Program program = squared("square");
  const std::string osl = print::osl_program(program, 0, {});
  const int operations = program.operations(), size = program.size();
  const Expr more = named("more", Expr::input("x") + Expr::input("z"));
  EXPECT_EQ(print::osl_program(program, 0, {}), osl);
  EXPECT_EQ(program.operations(), operations);
  EXPECT_EQ(program.size(), size);
  EXPECT_FALSE(more.is_literal());
}

TEST(Program, EqualsOneOfTheSameOperations) {
  Program first, renumbered, renamed, longer;
  {
    Recorder recorder;
    first = squared("square");
  }
  {
    Recorder recorder;
    renumbered = squared("square", 5);
  }
  {
    Recorder recorder;
    renamed = squared("power");
  }
  {
    Recorder recorder;
    longer = squared("square");
    longer.output("z", Expr::input("z"));
  }
  EXPECT_NE(first.size(), renumbered.size()) << "the numbers of its nodes do differ";
  EXPECT_TRUE(first == renumbered);
  EXPECT_EQ(print::osl_program(first, 0, {}), print::osl_program(renumbered, 0, {}));
  EXPECT_FALSE(first == renamed);
  EXPECT_FALSE(first == longer);
}

TEST(Program, EqualsOneRecordedInAnotherOrder) {
  const auto sum = [](bool turned, bool shared) {
    Recorder recorder;
    const Expr x = Expr::input("x");
    if (turned) static_cast<void>(exp(x));
    const Expr root = sqrt(x), power = exp(x);
    Program program;
    program.output("y", root - power * (shared ? power : cos(x)));
    return program;
  };
  EXPECT_TRUE(sum(false, true) == sum(true, true));
  EXPECT_FALSE(sum(false, true) == sum(true, false));
}

TEST(Program, DiffersByALoopsTurnsAndATablesNumbers) {
  const auto looped = [](int turns) {
    Recorder recorder;
    Program program;
    program.output("y", iterate(turns, std::array<Expr, 1>{Expr::input("x")},
                                [](const std::array<Expr, 1>& s) { return std::array<Expr, 1>{s[0] * s[0]}; })[0]);
    return program;
  };
  const auto looked_up = [](double last) {
    Recorder recorder;
    Program program;
    const auto table = make_table("t", {even_axis("x", 2)}, {0, last});
    program.output("y", lookup(table, std::array{Expr::input("x")}));
    return program;
  };
  EXPECT_TRUE(looped(3) == looped(3));
  EXPECT_FALSE(looped(3) == looped(4));
  EXPECT_TRUE(looked_up(1) == looked_up(1));
  EXPECT_FALSE(looked_up(1) == looked_up(2));
}

}  // namespace
}  // namespace brdfc
