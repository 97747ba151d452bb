// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/fingerprint.h"

#include <gtest/gtest.h>

#include <functional>
#include <set>

namespace brdfc {
namespace {

std::string of(const std::function<Expr()>& formula) {
  Recorder recorder;
  Program program;
  program.output("y", formula());
  return fingerprint(program);
}

Expr in(const char* name) { return Expr::input(name); }

std::shared_ptr<const Table> table(double last) { return make_table("t", {even_axis("x", 3)}, {0, 1, last}); }

Expr loop(int count, double factor) {
  return iterate(count, std::array<Expr, 2>{in("x"), in("y")}, [&](const std::array<Expr, 2>& s) {
    return std::array<Expr, 2>{s[1] * factor, s[0]};
  })[0];
}

TEST(Fingerprint, SeesWhatIsComputedAlone) {
  const std::string wanted = of([] { return in("x") * in("y") + sqrt(in("z")); });
  EXPECT_EQ(wanted.size(), 64u);
  EXPECT_EQ(wanted, of([] {
              // Nodes and operands in another order, with names and an unused node.
              const Expr z = in("z"), root = named("root", sqrt(z));
              static_cast<void>(exp(z));
              return root + in("y") * in("x");
            }));
  EXPECT_EQ(of([] { return in("x") * 0.1; }), of([] { return in("x") * (0.1 + 1e-14); }))
      << "what another library rounds otherwise";
}

TEST(Fingerprint, TellsFormulasApart) {
  const std::vector<std::function<Expr()>> formulas = {
      [] { return in("x") - in("y"); },
      [] { return in("y") - in("x"); },
      [] { return in("x") + in("y"); },
      [] { return in("x") * in("y"); },
      [] { return in("x") + in("z"); },
      [] { return in("x") * 0.1; },
      [] { return in("x") * 0.1000001; },
      [] { return exp(in("x")); },
      [] { return log(in("x")); },
      [] { return select(in("x") < in("y"), in("x"), in("y")); },
      [] { return select(in("x") < in("y"), in("y"), in("x")); },
      [] { return lookup(table(2), std::array<Expr, 1>{in("x")}); },
      [] { return lookup(table(2.001), std::array<Expr, 1>{in("x")}); },
      [] { return loop(3, 0.5); },
      [] { return loop(4, 0.5); },
      [] { return loop(3, 0.6); },
  };
  std::set<std::string> found;
  for (const auto& formula : formulas) found.insert(of(formula));
  EXPECT_EQ(found.size(), formulas.size());
}

}  // namespace
}  // namespace brdfc
