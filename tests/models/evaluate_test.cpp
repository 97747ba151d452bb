// SPDX-License-Identifier: GPL-3.0-or-later
// Different ways to evaluate a bound model give the same result.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

#include "support.h"

namespace brdfc {
namespace {

class EveryModelBound : public testing::TestWithParam<std::string> {};

Vec3<double> any_direction(std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  return direction(std::max(u(random), 1e-6), 2 * kPi * u(random));
}

/// The defaults, both ends of each number's slider, and every choice.
std::vector<ParamValues> corners(const Model& m) {
  std::vector<ParamValues> out{values_of(m, {})};
  for (const ParamInfo& p : m.info().params) {
    const auto with = [&](const auto& value) {
      out.push_back(out[0]);
      out.back()[p.name] = value;
    };
    if (p.kind == ParamKind::Number) {
      with(p.soft_min);
      with(p.soft_max);
    }
    for (const std::string& choice : p.choices) with(choice);
  }
  return out;
}

struct Directions {
  std::array<Vec3<double>, kLanes> wi, wo, u;
};
Directions any_directions(const Model& m, std::mt19937_64& random) {
  std::uniform_real_distribution<double> number(0, 1);
  Directions d;
  for (std::size_t k = 0; k < kLanes; ++k) {
    d.wi[k] = any_direction(random);
    d.wo[k] = any_direction(random);
    // Half of them near the mirror direction, where narrow lobes are not 0.
    if (k % 2) {
      d.wi[k] = {-d.wo[k].x, -d.wo[k].y, d.wo[k].z};
      d.wi[k].x += 1e-3 * number(random), d.wi[k] = normalize(d.wi[k]);
    }
    if (m.two_sided() && k % 4 > 1) d.wi[k].z = -d.wi[k].z;
    if (m.two_sided() && k % 8 > 3) d.wo[k].z = -d.wo[k].z;
    d.u[k] = {number(random), number(random), number(random)};
  }
  return d;
}
Vec3<Pack> pack(const std::array<Vec3<double>, kLanes>& from) {
  Vec3<Pack> out;
  for (std::size_t k = 0; k < kLanes; ++k) out.x[k] = from[k].x, out.y[k] = from[k].y, out.z[k] = from[k].z;
  return out;
}

/// A model for eight directions: its own, and the one for processors for which no model is compiled.
std::vector<std::unique_ptr<PackedBrdf>> both_packed(const Model& m, const ParamValues& values) {
  std::vector<std::unique_ptr<PackedBrdf>> out;
  out.push_back(m.make_packed(values));
  out.push_back(one_by_one([&] { return m.make_double(values); }));
  return out;
}

/// The vector library differs in the last digits, which some formulas amplify.
void expect_close(double packed, double alone, const std::string& what) {
  ASSERT_NEAR(packed, alone, 1e-9 * std::abs(alone) + 1e-290) << what;
}
void expect_close(const Rgb<double>& packed, const Rgb<double>& alone, const std::string& what) {
  expect_close(packed.r, alone.r, what);
  expect_close(packed.g, alone.g, what);
  expect_close(packed.b, alone.b, what);
}

TEST_P(EveryModelBound, TakesEightAtOnceAsOneByOne) {
  const Model& m = find_model(GetParam());
  std::mt19937_64 random(1);
  int lit = 0;
  for (const ParamValues& values : corners(m)) {
    const auto brdf = m.make_double(values);
    for (const auto& packed : both_packed(m, values)) {
      ASSERT_EQ(packed->ior()[0], brdf->ior());
      for (std::size_t c = 0; c < 3; ++c) ASSERT_EQ(packed->channel_iors()[c][0], brdf->channel_iors()[c]);
      for (int i = 0; i < 40; ++i) {
        const Directions d = any_directions(m, random);
        const Vec3<Pack> wi = pack(d.wi), wo = pack(d.wo);
        const auto [f, pdf] = packed->evaluate(wi, wo);
        const Sample<Pack> samples = packed->sample(wo, pack(d.u));
        const Rgb<Pack> mirror = packed->mirror(wo), transmit = packed->transmit(wo);
        const Rgb<Pack> left = packed->transmittance(abs(wi.x));
        for (std::size_t k = 0; k < kLanes; ++k) {
          const std::string what = fmt::format(
              "{} lane {} wi=({:.17g}, {:.17g}, {:.17g}) wo=({:.17g}, {:.17g}, {:.17g})",
              format_values(m.info(), values), k, d.wi[k].x, d.wi[k].y, d.wi[k].z, d.wo[k].x, d.wo[k].y, d.wo[k].z);
          expect_close(lane(f, k), brdf->eval(d.wi[k], d.wo[k]), "f " + what);
          expect_close(pdf[k], brdf->pdf(d.wi[k], d.wo[k]), "pdf " + what);
          expect_close(lane(mirror, k), brdf->mirror(d.wo[k]), "mirror " + what);
          expect_close(lane(transmit, k), brdf->transmit(d.wo[k]), "transmit " + what);
          expect_close(lane(left, k), brdf->transmittance(std::abs(d.wi[k].x)), "transmittance " + what);
          const Sample<double> s = brdf->sample(d.wo[k], d.u[k]);
          const Vec3<double> way = lane(samples.wi, k) - s.wi;
          ASSERT_LT(length(way), 1e-9) << "sample " << what;
          expect_close(lane(samples.weight, k), s.weight, "weight " + what);
          expect_close(samples.pdf[k], s.pdf, "pdf of sample " + what);
          lit += s.pdf > 0;
        }
      }
    }
  }
  EXPECT_TRUE(lit > 100 || !m.has_scatter());
}

/// A path's light must not depend on other paths.
TEST_P(EveryModelBound, LanesKnowNothingOfEachOther) {
  const Model& m = find_model(GetParam());
  const auto packed = m.make_packed(values_of(m, {}));
  std::mt19937_64 random(3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::array<Vec3<double>, 4> others{{{0, 0, 1}, {nan, nan, nan}, {1, 0, 0}, {1e300, 0, -1e300}}};
  for (int i = 0; i < 40; ++i) {
    Directions d = any_directions(m, random);
    const auto [f, pdf] = packed->evaluate(pack(d.wi), pack(d.wo));
    const Sample<Pack> s = packed->sample(pack(d.wo), pack(d.u));
    const std::size_t kept = std::size_t(i) % kLanes;
    for (std::size_t k = 0; k < kLanes; ++k)
      if (k != kept) d.wi[k] = d.wo[k] = d.u[k] = others[k % 4];
    const auto [other_f, other_pdf] = packed->evaluate(pack(d.wi), pack(d.wo));
    const Sample<Pack> other = packed->sample(pack(d.wo), pack(d.u));
    ASSERT_EQ(f.g[kept], other_f.g[kept]);
    ASSERT_EQ(pdf[kept], other_pdf[kept]);
    ASSERT_EQ(s.wi.x[kept], other.wi.x[kept]);
    ASSERT_EQ(s.weight.g[kept], other.weight.g[kept]);
    ASSERT_EQ(s.pdf[kept], other.pdf[kept]);
  }
}

/// Assigning a parameter later has the same effect as setting it from the start.
TEST_P(EveryModelBound, TakesParametersAnew) {
  const Model& m = find_model(GetParam());
  std::mt19937_64 random(2);
  for (const ParamInfo& p : m.info().params) {
    if (p.kind == ParamKind::Choice) continue;
    const double x = p.soft_min + 0.3 * (p.soft_max - p.soft_min);
    ParamValues values = values_of(m, {});
    if (p.kind == ParamKind::Number)
      values[p.name] = x;
    else
      values[p.name] = std::array<double, 3>{x, x / 2, x / 3};
    const auto expected = m.make_double(values), brdf = m.make_double(values_of(m, {}));
    brdf->assign("no such parameter", {7, 7, 7});
    brdf->assign(p.name, {x, x / 2, x / 3});
    for (int i = 0; i < 20; ++i) {
      const Vec3<double> wi = any_direction(random), wo = any_direction(random);
      ASSERT_EQ(brdf->eval(wi, wo).g, expected->eval(wi, wo).g) << p.name;
      ASSERT_EQ(brdf->mirror(wo).g, expected->mirror(wo).g) << p.name;
    }
    // Of eight lanes, one gets the new value and the others keep theirs.
    const auto old = p.kind == ParamKind::Number ? std::array<double, 3>{std::get<double>(values_of(m, {})[p.name])}
                                                 : std::get<std::array<double, 3>>(values_of(m, {})[p.name]);
    std::array<Pack, 3> value{old[0], old[1], old[2]};
    value[0][5] = x, value[1][5] = x / 2, value[2][5] = x / 3;
    const auto before = both_packed(m, values_of(m, {})), after = both_packed(m, values);
    for (std::size_t way = 0; way < before.size(); ++way) {
      const auto packed = std::move(both_packed(m, values_of(m, {}))[way]);
      packed->assign(p.name, value);
      for (int i = 0; i < 20; ++i) {
        const Directions d = any_directions(m, random);
        const Pack f = packed->evaluate(pack(d.wi), pack(d.wo)).f.g;
        ASSERT_EQ(f[5], after[way]->evaluate(pack(d.wi), pack(d.wo)).f.g[5]) << p.name;
        ASSERT_EQ(f[4], before[way]->evaluate(pack(d.wi), pack(d.wo)).f.g[4]) << p.name;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, EveryModelBound, testing::ValuesIn(model_names()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace brdfc
