// SPDX-License-Identifier: GPL-3.0-or-later
// The closures that a model declares as its base.
#include <gtest/gtest.h>

#include <cmath>

#include "analysis/probes.h"
#include "represent/lobe.h"
#include "support.h"

namespace brdfc {
namespace {

Vec3<Expr> recorded(const char* name) {
  const std::string n = name;
  return {Expr::input(n + "_x"), Expr::input(n + "_y"), Expr::input(n + "_z")};
}

using Inputs = std::map<std::string, std::array<double, 3>>;
void give(Inputs& inputs, const std::string& name, const Vec3<double>& v) {
  inputs[name + "_x"] = {v.x, v.x, v.x};
  inputs[name + "_y"] = {v.y, v.y, v.y};
  inputs[name + "_z"] = {v.z, v.z, v.z};
}

/// Lobe is what the conformance tests hold against Cycles, with any tangent.
TEST(Closure, StretchesFacetsAlongATangentOfTheSurface) {
  Random random(4);
  for (const auto& [kind, lobe_kind] :
       {std::pair{ClosureKind::Ggx, LobeKind::Ggx}, {ClosureKind::Beckmann, LobeKind::Beckmann}}) {
    Recorder recorder;
    Closure<Expr> recorded_closure(kind, Rgb<Expr>::input("weight"));
    recorded_closure.alpha = Expr::input("alpha");
    recorded_closure.alpha_across = Expr::input("across");
    recorded_closure.tangent = {cos(Expr::input("angle")), sin(Expr::input("angle")), Expr(0)};
    recorded_closure.stretched = Tangent::Surface;
    Program program;
    program.output("f_cos", evaluate(recorded_closure, recorded("wi"), recorded("wo")));
    EXPECT_LE(program.operations(), 80) << "a base is evaluated for every lamp";

    for (int i = 0; i < 200; ++i) {
      const Vec3<double> wi = uniform_direction(random), wo = uniform_direction(random);
      const double angle = 6 * uniform(random), alpha = 0.05 + 0.9 * uniform(random), across = 0.05 + 0.9 * uniform(random);
      Closure<double> c(kind, Rgb<double>(0.2, 0.5, 1));
      c.alpha = alpha, c.alpha_across = across;
      c.tangent = {std::cos(angle), std::sin(angle), 0};
      c.stretched = Tangent::Surface;
      Lobe lobe;
      lobe.kind = lobe_kind;
      lobe.weight = c.weight;
      lobe.tangent = c.tangent;
      lobe.alpha_x = alpha, lobe.alpha_y = across;
      const Rgb<double> expected = evaluate(lobe, wi, wo), found = evaluate(c, wi, wo);
      EXPECT_NEAR(found.g, expected.g, 1e-12 * (1 + expected.g));
      EXPECT_NEAR(found.r, expected.r, 1e-12 * (1 + expected.r));

      Inputs inputs = {{"weight", {0.2, 0.5, 1}}, {"alpha", {alpha, alpha, alpha}}, {"across", {across, across, across}},
                       {"angle", {angle, angle, angle}}};
      give(inputs, "wi", wi);
      give(inputs, "wo", wo);
      EXPECT_NEAR(program.run<double>(inputs).at("f_cos")[1], expected.g, 1e-12 * (1 + expected.g));
    }
  }
}

TEST(Closure, LooksARampUpWithoutAnIndex) {
  Closure<double> c(ClosureKind::DiffuseRamp, Rgb<double>(0.5));
  Recorder recorder;
  Closure<Expr> constant(ClosureKind::DiffuseRamp, Rgb<Expr>(Expr(0.5))), varied = constant;
  for (std::size_t i = 0; i < kRampSize; ++i) {
    c.ramp[i] = {double(i * i), -double(i), 1};
    varied.ramp[i] = {Expr(c.ramp[i].r), Expr(c.ramp[i].g), Expr(c.ramp[i].b)};
    constant.ramp[i] = Rgb<Expr>(Expr(1));
  }
  Program of_varied, of_constant;
  of_varied.output("f_cos", evaluate(varied, recorded("wi"), recorded("wo")));
  of_constant.output("f_cos", evaluate(constant, recorded("wi"), recorded("wo")));
  EXPECT_LE(of_constant.operations(), 4) << "a constant ramp is no look-up";
  const Vec3<double> wo{0, 0, 1};
  for (int i = 0; i <= 100; ++i) {
    const double z = i / 100.;
    const Vec3<double> wi{std::sqrt(1 - z * z), 0, z};
    Inputs inputs;
    give(inputs, "wi", wi);
    const std::array<double, 3> found = of_varied.run<double>(inputs).at("f_cos");
    const Rgb<double> expected = evaluate(c, wi, wo);
    EXPECT_NEAR(found[0], expected.r, 1e-12);
    EXPECT_NEAR(found[1], expected.g, 1e-12);
    EXPECT_NEAR(found[2], expected.b, 1e-12);
  }
  for (const double outside : {-0.5, 0., 1., 2.}) EXPECT_EQ(ramp8(c.ramp, outside).r, outside > 0.5 ? 49 : 0);
}

}  // namespace
}  // namespace brdfc
