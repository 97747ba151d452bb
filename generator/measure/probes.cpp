// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/probes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "model/choices.h"
#include "model/sampling.h"

namespace brdfc::measure {

double uniform(Random& random) { return double(random() >> 11) * 0x1p-53; }

Vec3<double> uniform_direction(Random& random) {
  const double c = 1 - uniform(random);
  return direction(c, 2 * kPi * uniform(random));
}

Vec3<double> uniform_cube(Random& random) {
  const double a = uniform(random), b = uniform(random), c = uniform(random);
  return {a, b, c};
}

std::vector<std::array<Vec3<double>, 2>> direction_pairs(const Brdf<double>& brdf, int count, Random& random,
                                                         bool two_sided) {
  std::vector<std::array<Vec3<double>, 2>> out;
  const Vec3<double> normal{0, 0, 1};
  const auto grazing = [&] {
    const double c = std::pow(10, -5 * uniform(random));
    return direction(c, 2 * kPi * uniform(random));
  };
  for (int i = 0; i < count; ++i) {
    Vec3<double> wo = uniform_direction(random), wi = uniform_direction(random);
    if (i % 8 == 5) wo = grazing();
    if (i % 16 == 7) wo = normal;
    if (two_sided && random() & 1) wo.z = -wo.z;
    if (two_sided && random() & 1) wi.z = -wi.z;
    const Vec3<double> u = uniform_cube(random);
    if (i % 2 == 0)
      if (const Sample<double> s = brdf.sample(wo, u); s.pdf > 0 && (two_sided || s.wi.z > 0)) wi = s.wi;
    if (i % 16 == 3) wi = {-wo.x, -wo.y, wo.z};
    if (i % 16 == 9) wi = wo;
    if (i % 16 == 11) wi = grazing();
    if (two_sided && i % 16 == 13) wi = refract(wo, brdf.ior());
    if (two_sided ? wi.z != 0 && wo.z != 0 : wi.z > 0 && wo.z > 0) out.push_back({wi, wo});
  }
  return out;
}

ParamValues random_values(const ModelInfo& info, ParamValues values, Random& random) {
  for (const ParamInfo& p : info.params) {
    if (p.kind == ParamKind::Number) values[p.name] = p.slider().at(uniform(random));
    if (p.kind == ParamKind::Color) {
      const double r = uniform(random), g = uniform(random), b = uniform(random);
      values[p.name] = std::array<double, 3>{r, g, b};
    }
  }
  return complete(info, values);
}

std::vector<ParamValues> slider_cases(const ModelInfo& info, int draws, std::uint64_t seed) {
  Random random(seed);
  std::vector<ParamValues> out;
  for (const Choices& c : choice_combinations(info)) {
    const ParamValues choices = with_choices(info, c);
    out.push_back(complete(info, choices));
    for (int i = 0; i < draws; ++i) out.push_back(random_values(info, choices, random));
  }
  return out;
}

std::vector<ParamValues> end_cases(const ModelInfo& info, bool sliders) {
  std::vector<ParamValues> out;
  ParamValues all_min, all_max;
  for (const ParamInfo& p : info.params) {
    if (p.kind == ParamKind::Choice) continue;
    const double low = sliders ? p.soft_min : p.min, high = sliders ? p.soft_max : p.max;
    for (const double end : {low, high}) out.push_back(complete(info, {{p.name, end}}));
    all_min[p.name] = low;
    all_max[p.name] = high;
  }
  if (all_min.size() > 1) {
    out.push_back(complete(info, all_min));
    out.push_back(complete(info, all_max));
  }
  return out;
}

std::vector<ParamValues> thin_out(const ModelInfo& info, const std::vector<ParamValues>& cases, std::size_t most) {
  if (cases.size() <= most) return cases;
  std::vector<std::set<std::string>> pairs;
  for (const ParamValues& v : cases) {
    std::vector<std::string> chosen;
    for (const ParamInfo& p : info.params)
      if (p.kind == ParamKind::Choice) chosen.push_back(p.name + "=" + std::get<std::string>(v.at(p.name)));
    std::set<std::string> mine(chosen.begin(), chosen.end());
    for (std::size_t i = 0; i < chosen.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) mine.insert(chosen[i] + " " + chosen[j]);
    pairs.push_back(std::move(mine));
  }
  std::vector<ParamValues> out;
  std::vector<bool> taken(cases.size(), false);
  std::set<std::string> covered;
  while (out.size() < most) {
    std::size_t best = cases.size(), gain = 0;
    for (std::size_t i = 0; i < cases.size(); ++i) {
      if (taken[i]) continue;
      const std::size_t g = std::size_t(
          std::count_if(pairs[i].begin(), pairs[i].end(), [&](const std::string& p) { return !covered.count(p); }));
      if (g > gain) best = i, gain = g;
    }
    if (best == cases.size()) break;
    taken[best] = true;
    covered.insert(pairs[best].begin(), pairs[best].end());
    out.push_back(cases[best]);
  }
  // Takes the remaining cases at even distances, so that defaults, random values and ends of ranges are all
  // represented.
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < cases.size(); ++i)
    if (!taken[i]) left.push_back(i);
  const std::size_t wanted = most - out.size();
  for (std::size_t k = 0; k < wanted; ++k) out.push_back(cases[left[(2 * k + 1) * left.size() / (2 * wanted)]]);
  return out;
}

}  // namespace brdfc::measure
