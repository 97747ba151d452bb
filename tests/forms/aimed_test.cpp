// SPDX-License-Identifier: GPL-3.0-or-later
// The sum of base, lamps and rest equals the model.
#include "forms/aimed.h"

#include <gtest/gtest.h>

#include "core/parallel.h"
#include "core/sequence.h"
#include "fit/fit.h"
#include "forms/form.h"
#include "measure/probes.h"
#include "support.h"

namespace brdfc::forms {
namespace {

/// A disk with arbitrary axes perpendicular to a direction.
LampPatch<double> disk(const Vec3<double>& centre, double radius, double ratio = 1) {
  const Vec3<double> away = std::abs(centre.z) < 0.9 * length(centre) ? Vec3<double>{0, 0, 1} : Vec3<double>{1, 0, 0};
  const Vec3<double> across = normalize(cross(centre, away));
  return {centre, across * radius, normalize(cross(centre, across)) * (radius * ratio), 1};
}

bool meets(const LampPatch<double>& p, const Vec3<double>& w) {
  const Vec3<double> n = cross(p.across, p.along);
  if (dot(n, w) == 0) return false;
  const double t = dot(n, p.centre) / dot(n, w);
  const Vec3<double> at = w * t - p.centre;
  const double x = dot(at, p.across) / dot(p.across, p.across), y = dot(at, p.along) / dot(p.along, p.along);
  return t > 0 && (p.disk > 0.5 ? x * x + y * y < 1 : std::max(std::abs(x), std::abs(y)) < 1);
}

/// Smooth light from all directions.
double sky(const Vec3<double>& w) { return 0.6 + 0.3 * w.x - 0.2 * w.y * w.z; }

/// Integral of g over the directions of a uniformly lit patch, times `light`.
template <class G> double over_patch(const LampPatch<double>& p, double light, const G& g) {
  constexpr int kSteps = 96;
  const double area = length(cross(p.across, p.along));
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      double x = 2 * (i + 0.5) / kSteps - 1, y = 2 * (j + 0.5) / kSteps - 1, weight = 4 * area;
      if (p.disk > 0.5) {
        const double r = std::sqrt((i + 0.5) / kSteps), a = 2 * kPi * (j + 0.5) / kSteps;
        x = r * std::cos(a), y = r * std::sin(a), weight = kPi * area;
      }
      const Vec3<double> at = p.at(x, y), w = normalize(at);
      const double d2 = dot(at, at);
      sum += g(w) * weight * std::abs(dot(normalize(cross(p.across, p.along)), w)) / d2 / (kSteps * kSteps);
    }
  return sum * light;
}

/// Integral over the sky above the surface, for an integrand that is 0 outside an angle about an axis.
template <class G> double over_sky(const Vec3<double>& axis, double cosEnd, const G& g) {
  constexpr int kHeights = 256, kTurns = 256;
  const Vec3<double> t = normalize(cross(axis, std::abs(axis.x) < 0.9 ? Vec3<double>{1, 0, 0} : Vec3<double>{0, 1, 0})),
                     b = cross(axis, t);
  double sum = 0;
  for (int i = 0; i < kHeights; ++i)
    for (int j = 0; j < kTurns; ++j) {
      const double c = 1 - (1 - cosEnd) * (i + 0.5) / kHeights, s = std::sqrt(1 - c * c),
                   a = 2 * kPi * (j + 0.5) / kTurns;
      const Vec3<double> w = axis * c + t * (s * std::cos(a)) + b * (s * std::sin(a));
      if (w.z > 0) sum += g(w) * sky(w);
    }
  return sum * 2 * kPi * (1 - cosEnd) / (kHeights * kTurns);
}

/// The light that reaches the viewer from a sky and uniform lamps, for one sample: closures by quadrature, the sampled
/// direction by its weight.
struct Scene {
  std::vector<LampPatch<double>> patches;
  std::vector<double> light;

  double radiance(const Vec3<double>& w) const {
    double sum = w.z > 0 ? sky(w) : 0;
    for (std::size_t k = 0; k < patches.size(); ++k) sum += meets(patches[k], w) ? light[k] : 0;
    return sum;
  }
  template <class G> double of_lamps(const G& g) const {
    double sum = 0;
    for (std::size_t k = 0; k < patches.size(); ++k) sum += over_patch(patches[k], light[k], g);
    return sum;
  }
};

/// Lamps near the mirror direction and away from it, large, small, and inside one another's lobes, but no closer to one
/// another than their seams (against()).
Scene scene_for(const Vec3<double>& wo) {
  const Vec3<double> mirror = reflect(wo), beside = normalize(mirror + Vec3<double>{0.05, 0.12, 0.1});
  Scene scene;
  scene.patches = {disk(normalize(Vec3<double>{0.4, -0.6, 0.8}) * 3.0, 0.6),
                   disk(beside * 5.0, 0.1),
                   {Vec3<double>{-0.5, 1.2, 1.4}, {0.5, 0, 0}, {0, 0.3, -0.25}, 0},
                   disk(normalize(beside + Vec3<double>{0.06, 0, 0}), 0.005),
                   disk(normalize(Vec3<double>{-0.6, 0.2, 0.5}) * 2.0, 0.3, 0.4)};
  scene.light = {3, 400, 5, 1e5, 10};
  return scene;
}

struct Case {
  const char* model;
  std::vector<std::string> values;
};

/// Compares the sum of base, lamps and rest with the model, under a sky and five lamps. The mean over the samples must
/// agree within 4.5 standard errors, or within 0.2 % to allow for quadrature errors. The base is declared by the model,
/// or a fit.
void expect_model(const Model& m, const ParamValues& values, AimedBase from = AimedBase::Declared) {
  constexpr int kDraws = 20000;
  const auto brdf = m.make_double(values);
  if (brdf->scatters_through()) return;
  for (const double cosTheta_o : {0.15, 0.5, 0.95}) {
    const Vec3<double> wo = direction(cosTheta_o, 0.3);
    const Scene scene = scene_for(wo);
    const auto f_cos = [&](const Vec3<double>& w) { return brdf->eval(w, wo).g * std::max(w.z, 0.0); };
    const ClosureSum<double> base = from == AimedBase::Fitted
                                        ? fit::fit_of(m, values).closures(wo, fit::fit_of(m, values).varied(values))
                                        : brdf->base(wo);
    // Both ways sample the sky in the same way; they differ in how lamps are found.
    const double base_lamps = base.empty() ? 0 : scene.of_lamps([&](const auto& w) { return evaluate(base, w, wo).g; });
    const double lamps = scene.of_lamps(f_cos);
    measure::Random random(7);
    std::vector<AimedLobe<double>> lobes;
    std::vector<double> of_lobe;
    std::vector<std::array<double, 3>> v(scene.patches.size());
    double sum = 0, squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      const Vec3<double> u = measure::uniform_cube(random);
      for (auto& numbers : v) {
        const Vec3<double> number = measure::uniform_cube(random);
        numbers = {number.x, number.y, number.z};
      }
      const AimedSum s = aimed_sum(*brdf, base, scene.patches, wo, u, v);
      if (lobes.empty()) {  // independent of the sampled direction
        lobes = s.lobes;
        for (const AimedLobe<double>& lobe : lobes) {
          const auto value = [&](const Vec3<double>& w) { return evaluate(lobe, w); };
          of_lobe.push_back(over_sky(lobe.towards, lobe.cosEnd, value) + scene.of_lamps(value));
        }
      }
      double given = s.rest.g * scene.radiance(s.wi) + base_lamps;
      for (std::size_t k = 0; k < s.lobes.size(); ++k) given += s.values[k].g * of_lobe[k];
      // The base under the sky, with the same pdf to reduce noise: the sampled directions carry f cos - base.
      if (!base.empty() && s.density > 0 && s.drawn.z > 0)
        given += evaluate(base, s.drawn, wo).g / s.density * sky(s.drawn);
      sum += given / kDraws;
      squares += given * given / kDraws;
    }
    double truth = lamps;
    Sequence3 points(11);
    constexpr int kPoints = 1 << 17;
    for (int i = 0; i < kPoints; ++i) {
      const Sample<double> s = brdf->sample(wo, points.next());
      if (s.pdf > 0 && s.wi.z > 0) truth += s.weight.g * sky(s.wi) / kPoints;
    }
    const double error = std::sqrt(std::max(squares - sum * sum, 0.0) / kDraws);
    EXPECT_NEAR(sum, truth, std::max(4.5 * error, 2e-3 * truth))
        << m.info().name << " " << format_values(m.info(), values) << " at " << cosTheta_o << ", standard error "
        << error;
    EXPECT_LT(error, 0.05 * truth) << m.info().name << ": too noisy to compare";
  }
}

TEST(Aimed, AddsUpToTheModel) {
  for (const std::string& name : third_of(model_names()))
    if (const Model& m = find_model(name); m.has_scatter()) expect_model(m, complete(m.info(), {}));
}

TEST(Aimed, AddsUpToTheModelWhereItIsStiff) {
  const Case cases[] = {{"ashikhmin_shirley", {"nu=100", "nv=10000", "rd=0", "rs=0.9"}},
                        {"phong", {"e=5000"}},
                        {"glossy_reflector", {"e=250"}},
                        {"max_phong", {"e=3"}},
                        {"ward", {"ax=0.02", "ay=0.3"}},
                        {"cook_torrance", {"m=0.05"}},
                        {"schlick", {"rough=0.01", "p=0.5"}},
                        {"blinn", {"e=2000"}}};
  for (const Case& c : third_of(cases)) {
    const Model& m = find_model(c.model);
    expect_model(m, values_of(m, c.values));
  }
}

TEST(Aimed, AddsUpToTheModelWhereTheBaseIsAFit) {
  const Case cases[] = {{"phong", {"e=20"}}, {"oren_nayar", {}}, {"radziszewski_alda", {"n=4"}}, {"ward", {}}};
  for (const Case& c : cases) {
    const Model& m = find_model(c.model);
    expect_model(m, values_of(m, c.values), AimedBase::Fitted);
  }
}

TEST(Aimed, NoPointOfALampStandsForTheWholeOfIt) {
  // A grazing view towards a lamp just above the opposite horizon, where the closure's normal is almost perpendicular
  // to both: a point below the closure's horizon once made a pixel of 1e24.
  measure::Random random(3);
  int aimed = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3<double> wo = direction(0.1 * measure::uniform(random), 0.2);
    const double turn = 0.2 + kPi + 0.3 * (measure::uniform(random) - 0.5);
    const LampPatch<double> lamp =
        disk(direction(0.1 * measure::uniform(random), turn) * 2.0, 0.2 * measure::uniform(random));
    const AimedLamp<double> aim = aim_at(lamp, 1.0, measure::uniform(random), measure::uniform(random), wo);
    aimed += emphasis_of(aim) > 0;
    ASSERT_LE(emphasis_of(aim), 12) << i;
  }
  EXPECT_GT(aimed, 5000);
}

/// The light of a lamp that its closure carries on average, divided by that of f cos.
double carried(const Brdf<double>& brdf, const LampPatch<double>& lamp, const Vec3<double>& wo) {
  constexpr int kSteps = 64;
  double mean = 0;
  AimedLamp<double> aimed;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    aimed = aim_at(lamp, 1.0, (i / kSteps + 0.5) / kSteps, (i % kSteps + 0.5) / kSteps, wo);
    mean += brdf.eval(aimed.wi, wo).g * aimed.wi.z * emphasis_of(aimed) / (kSteps * kSteps);
  }
  EXPECT_GT(aimed.mean_rise, 0);
  const double lit = over_patch(lamp, 1, [&](const Vec3<double>& w) { return evaluate(aimed.lobe, w); });
  const double truth = over_patch(lamp, 1, [&](const Vec3<double>& w) { return brdf.eval(w, wo).g * w.z; });
  return mean * lit / truth;
}

/// A lamp of ten degrees on the flank of a lobe that falls by half across it. The points on the lamp and the directions
/// of light sampling are independent; so the product of the mean of f over the points and the mean of the aimed lobe
/// over the lamp must be the mean of f.
TEST(Aimed, ASlopeOverTheLampIsNotCountedTwice) {
  const Model& m = find_model("glossy_reflector");
  const auto brdf = m.make_double(values_of(m, {"e=25"}));
  for (const double cosTheta_o : {0.3, 0.6, 0.9}) {
    const Vec3<double> wo = direction(cosTheta_o, 0.3), mirror = reflect(wo);
    for (const Vec3<double>& offset :
         {Vec3<double>{0, 0, 0}, {0.2, 0, 0.1}, {-0.2, 0, 0.1}, {0, 0.2, 0.1}, {0, -0.2, 0.1}})
      for (const double disk_or_not : {1.0, 0.0}) {
        LampPatch<double> lamp = disk(normalize(mirror + offset), 0.17);
        lamp.disk = disk_or_not;
        if (lamp.centre.z < 0.3) continue;  // entirely above the surface
        EXPECT_NEAR(carried(*brdf, lamp, wo), 1, 1e-3)
            << cosTheta_o << " " << offset.x << " " << offset.y << " " << disk_or_not;
      }
  }
}

/// Lamps almost as wide as the widest that shaders aim at. With four points for the mean of their light, the disk of
/// 0.8 was 6 % too bright.
TEST(Aimed, AWideLampHasItsOwnLight) {
  for (const auto& [model, values] : {std::pair{"radziszewski_alda", "n=4"}, {"oren_nayar", "rho=0.7"}}) {
    const Model& m = find_model(model);
    const auto brdf = m.make_double(values_of(m, {values}));
    for (const Vec3<double>& wo : {direction(0.95, 0.3), direction(0.6, 2.0)})
      for (const double diagonal : {0.4, 0.6, 0.8})
        for (const double slant : {0.0, 0.6}) {
          const Vec3<double> centre = {0.1, 0.2, 2};
          LampPatch<double> lamp = disk(normalize(centre + Vec3<double>{slant, 0, 0}), diagonal * length(centre));
          lamp.centre = centre;
          for (const double disk_or_not : {1.0, 0.0}) {
            lamp.disk = disk_or_not;
            if (disk_or_not < 0.5) lamp.across = lamp.across * std::sqrt(0.5), lamp.along = lamp.along * std::sqrt(0.5);
            if (lowest(lamp, {0, 0, 1}) < 0) continue;
            EXPECT_NEAR(carried(*brdf, lamp, wo), 1, diagonal > 0.7 ? 0.015 : 5e-3)
                << model << " " << diagonal << " " << slant << " " << disk_or_not;
          }
        }
  }
}

/// Lamps that only partly light the point, because of their spread or the cone of a spot: f is averaged in proportion
/// to the light that arrives. The mean must agree within 2 % and four standard errors.
TEST(Aimed, AConeBoundsWhatIsAveragedOver) {
  double worst = 0, worst_whole = 0, worst_tight = 0;
  measure::Random random(4);
  for (const auto& [model, values] :
       {std::pair{"phong", "e=20"}, {"radziszewski_alda", "n=4"}, {"oren_nayar", "rho=0.7"}}) {
    const Model& m = find_model(model);
    const auto brdf = m.make_double(values_of(m, {values}));
    for (const double cosTheta_o : {0.4, 0.8})
      for (const double size : {0.16, 0.55})
        for (const double angle : {0.15, 0.35, 0.7})
          for (const double blend : {-1.0, 0.15, 1.0})
            for (const Vec3<double>& aside : {Vec3<double>{0, 0, 0}, {0.1, -0.2, 0.05}}) {
              const Vec3<double> wo = direction(cosTheta_o, 0.3),
                                 towards = normalize(reflect(wo) + Vec3<double>{0, 0, 0.3 + size});
              LampPatch<double> lamp = disk(towards * 5.0, 5 * size);
              lamp.disk = blend > 0;
              // The axis of the spread is the lamp's normal, so the point is moved instead.
              if (blend < 0) lamp.centre = lamp.centre + lamp.across * (5 * aside.x) + lamp.along * (5 * aside.y);
              if (lowest(lamp, {0, 0, 1}) < 0) continue;
              const LampBeam<double> beam{blend < 0 ? towards : normalize(towards + aside), std::cos(angle), blend};
              const auto light = [&](const Vec3<double>& w) { return beam(w); };
              const double all = over_patch(lamp, 1, light);
              const LampPatch<double> bounds = lit_bounds(lamp, beam);
              if (all < 1e-4) continue;
              // No light is lost.
              EXPECT_NEAR(over_patch(bounds, 1, [&](const auto& w) { return meets(lamp, w) ? beam(w) : 0; }), all,
                          0.02 * all);
              const double truth =
                  over_patch(lamp, 1, [&](const auto& w) { return beam(w) * brdf->eval(w, wo).g * w.z; });
              // How far the mean is off, and its standard error; 0 for a lamp that is left to drawn directions.
              const auto off = [&](bool of_bounds, int count, double room = 1) {
                double sum = 0, squares = 0;
                AimedLamp<double> aimed;
                for (int i = 0; i < count; ++i) {
                  const Vec3<double> v = measure::uniform_cube(random);
                  aimed = aim_at(of_bounds ? bounds : lamp, room, v.x, v.y, wo);
                  if (of_bounds)
                    aimed = lit(aimed, lit_point(bounds, lamp, beam, aimed.lobe.half, {0, 0, 1}, 0., v.x, v.y, v.z));
                  EXPECT_LT(emphasis_of(aimed), 10);
                  const double x = brdf->eval(aimed.wi, wo).g * std::max(aimed.wi.z, 0.0) * emphasis_of(aimed);
                  sum += x / count, squares += x * x / count;
                }
                if (!(aimed.mean_rise > 0)) return std::pair(0., 0.);
                const double lit =
                    over_patch(lamp, 1, [&](const auto& w) { return beam(w) * evaluate(aimed.lobe, w); });
                const double error = std::sqrt(std::max(squares - sum * sum, 0.) / count) * lit / truth;
                return std::pair(std::abs(sum * lit / truth - 1), error);
              };
              const auto [found, error] = off(true, 8192);
              EXPECT_LT(found, 0.02 + 4 * error)
                  << model << " " << cosTheta_o << " " << size << " " << angle << " " << blend << " " << aside.x;
              worst = std::max(worst, found - 2 * error);
              if (size > 0.5) continue;
              worst_whole = std::max(worst_whole, off(false, 4096).first);
              worst_tight = std::max(worst_tight, off(true, 4096, 0).first);
            }
  }
  EXPECT_GT(worst_whole, 0.1) << "nothing would be wrong without";
  // The lobe is narrow because of another lamp beside it.
  EXPECT_LT(worst_tight, 0.1);
  std::printf("worst %.4f, with the whole lamp %.4f, beside another lamp %.4f\n", worst, worst_whole, worst_tight);
}

/// Lamps that reach below the horizon, from where no lobe receives light: f is averaged over the part above.
TEST(Aimed, OfALampThatReachesBelowTheHorizonThePartAboveCounts) {
  constexpr int kSteps = 32;
  int tested = 0;
  double worst = 0, worst_whole = 0;
  for (const auto& [model, values] :
       {std::pair{"phong", "e=20"}, {"radziszewski_alda", "n=1"}, {"cook_torrance", "m=0.3"}}) {
    const Model& m = find_model(model);
    const auto brdf = m.make_double(values_of(m, {values}));
    for (const double cosTheta_o : {0.4, 0.8})
      // Shaders do not aim at lamps whose centre is below the horizon.
      for (const double height : {0.14, 0.02, 0.0})
        for (const double turn : {kPi, 2.0})
          // The last one is rotated about its centre, so that its sides are oblique to the horizon.
          for (const double roll : {-1.0, 0.0, 0.6}) {
            const Vec3<double> wo = direction(cosTheta_o, 0.3);
            LampPatch<double> lamp = disk(direction(height, 0.3 + turn) * 2.0, 0.4, 0.7);
            lamp.disk = roll < 0;
            if (roll > 0) {
              const Vec3<double> across = lamp.across;
              lamp.across = across * std::cos(roll) + lamp.along * std::sin(roll);
              lamp.along = lamp.along * std::cos(roll) - across * std::sin(roll);
              lamp.along = lamp.along - lamp.across * (dot(lamp.along, lamp.across) / dot(lamp.across, lamp.across));
            }
            for (const Vec3<double>& horizon : {Vec3<double>{0, 0, 1}, normalize(Vec3<double>{0.06, -0.04, 1})}) {
              if (lowest(lamp, horizon) >= 0) continue;
              const auto above = [&](const Vec3<double>& w, double x) { return dot(w, horizon) > 0 ? x : 0.0; };
              const auto f_cos = [&](const Vec3<double>& w) {
                return above(w, brdf->eval(w, wo).g * std::max(w.z, 0.0));
              };
              const double truth = over_patch(lamp, 1, f_cos);
              if (truth < 1e-4) continue;
              const auto off = [&](bool cut) {
                double mean = 0;
                AimedLamp<double> aimed;
                for (int i = 0; i < kSteps * kSteps; ++i) {
                  const double v1 = (i / kSteps + 0.5) / kSteps, v2 = (i % kSteps + 0.5) / kSteps;
                  aimed = aim_at(lamp, 1.0, v1, v2, wo);
                  if (cut) {
                    aimed = cut_off(aimed, lamp, horizon, v1, v2);
                    EXPECT_GT(dot(aimed.wi, horizon), -1e-9);
                    EXPECT_TRUE(meets(lamp, aimed.wi));
                  }
                  mean +=
                      brdf->eval(aimed.wi, wo).g * std::max(aimed.wi.z, 0.0) * emphasis_of(aimed) / (kSteps * kSteps);
                }
                const double lit =
                    over_patch(lamp, 1, [&](const auto& w) { return above(w, evaluate(aimed.lobe, w)); });
                return mean == 0 ? 0 : std::abs(mean * lit / truth - 1);  // or it is left to random directions
              };
              const double found = off(true);
              tested += found > 0;
              EXPECT_LT(found, 0.01) << model << " " << cosTheta_o << " " << height << " " << turn << " " << roll << " "
                                     << horizon.x;
              worst = std::max(worst, found);
              worst_whole = std::max(worst_whole, off(false));
            }
          }
  }
  EXPECT_GT(worst_whole, 0.3) << "nothing would be wrong without";
  EXPECT_GT(tested, 50);
  std::printf("%d, worst %.4f, with the whole lamp %.4f\n", tested, worst, worst_whole);
}

/// The sampled direction carries a lamp's light in a lobe 1e-3 wide, which must be either completely on the lamp or
/// completely outside.
TEST(Aimed, NothingOfTheRestReachesOverTheEdgeOfALamp) {
  measure::Random random(5);
  const auto around = [](const Vec3<double>& w, double by, const auto& all) {
    const Vec3<double> t = normalize(cross(w, std::abs(w.x) < 0.9 ? Vec3<double>{1, 0, 0} : Vec3<double>{0, 1, 0}));
    for (int k = 0; k < 16; ++k)
      if (!all(normalize(w + t * (by * std::cos(k * kPi / 8)) + cross(w, t) * (by * std::sin(k * kPi / 8)))))
        return false;
    return true;
  };
  int near[2] = {}, moved[2] = {};
  for (int i = 0; i < 40000; ++i) {
    LampPatch<double> lamp = disk(direction(0.7, 2.0) * 3.0, 0.2, 0.5 + measure::uniform(random));
    if (i % 2) lamp.disk = 0;
    const double x = 1.1 * (2 * measure::uniform(random) - 1), y = 1.1 * (2 * measure::uniform(random) - 1);
    const Vec3<double> w = normalize(lamp.at(x, y));
    const bool on = meets(lamp, w);
    const Against<double> met = against(lamp, w);
    ASSERT_EQ(met.meets > 0, on) << i;
    const Vec3<double> to = met.moved;
    ++near[on];
    moved[on] += length(to - w) > 1e-9;
    if (length(to - w) > 1e-9) {
      ASSERT_GT(met.in_seam, 0) << i;
    }
    const auto same_side = [&](const Vec3<double>& d) { return meets(lamp, d) == on; };
    ASSERT_TRUE(around(to, 3e-3, same_side)) << i << ": " << x << " " << y;
    ASSERT_LT(length(to - w), 1e-2) << i;
    if (around(w, 1e-2, same_side)) {
      ASSERT_LT(length(to - w), 1e-12) << i << ": far from the edge, and moved";
    }
  }
  for (const int side : {0, 1}) {
    EXPECT_GT(moved[side], near[side] / 20);
    EXPECT_LT(moved[side], near[side] / 2);
  }
}

TEST(Aimed, DirectionsUnderALobeHaveTheirDensity) {
  for (const double radius : {0.01, 0.5}) {
    const Vec3<double> wo = direction(0.6, 1);
    const LampPatch<double> patch = disk({0.3, -0.5, 0.9}, radius);
    const AimedLobe<double> lobe = aim_at(patch, 1.0, 0.5, 0.5, wo).lobe;
    double mean = 0;
    constexpr int kSteps = 100;
    for (int i = 0; i < kSteps; ++i) {
      const Vec3<double> w = sample_under(lobe, (i + 0.5) / kSteps, std::fmod(i * 0.618, 1.0));
      EXPECT_NEAR(length(w), 1, 1e-12);
      EXPECT_NEAR(pdf_under(lobe, w) * lobe.extent, 1, 1e-12);
      mean += dot(w, lobe.towards) / kSteps;
    }
    // The cosine is uniformly distributed over a cap.
    EXPECT_NEAR(mean, (1 + lobe.cosEnd) / 2, 1e-9);
    EXPECT_NEAR(lobe.extent, 2 * kPi * (1 - lobe.cosEnd), 1e-9);
    EXPECT_EQ(pdf_under(lobe, lobe.towards * -1.0), 0);
  }
}

TEST(Aimed, DirectionsFromEverywhereHaveTheirDensity) {
  double all = 0, mean = 0;
  constexpr int kSteps = 400;
  for (int i = 0; i < kSteps; ++i) {
    const double z = (i + 0.5) / kSteps;
    all += 2 * kPi * everywhere_pdf(Vec3<double>{std::sqrt(1 - z * z), 0, z}) / kSteps;
    // The fraction of directions below equals the random number.
    const Vec3<double> w = sample_everywhere(z, 0.3);
    EXPECT_NEAR((w.z * w.z + w.z) / 2, z, 1e-12);
    EXPECT_NEAR(length(w), 1, 1e-12);
    mean += w.z / kSteps;
  }
  EXPECT_NEAR(all, 1, 1e-6);
  EXPECT_NEAR(mean, 7.0 / 12, 1e-5);
  EXPECT_EQ(everywhere_pdf(Vec3<double>{0.6, 0, -0.8}), 0);
}

TEST(Aimed, ProfileIsLevelAndFalls) {
  for (int i = 0; i <= 1000; ++i) {
    const double x = i / 1000.0, y = aimed_profile(x);
    // The ramp as Cycles evaluates it.
    const double position = 7 * x;
    const int k = std::min(int(position), 6);
    const auto ramp = aimed_ramp();
    EXPECT_NEAR(y, x * (ramp[k] + (position - k) * (ramp[k + 1] - ramp[k])), 1e-12) << x;
    if (x >= 3.0 / 7) {
      EXPECT_NEAR(y, 1, 0.021) << x;
    }
    if (x <= 2.0 / 7) {
      EXPECT_EQ(y, 0) << x;
    }
  }
}

}  // namespace
}  // namespace brdfc::forms
