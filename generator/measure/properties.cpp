// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/properties.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/text.h"
#include "measure/albedo.h"

namespace brdfc::measure {
namespace {

double sum(const Rgb<double>& c) { return c.r + c.g + c.b; }
std::array<double, 3> channels(const Rgb<double>& c) { return {c.r, c.g, c.b}; }

bool is_black(const Rgb<Wide>& c) { return !(c.r > Wide(0) && c.g > Wide(0) && c.b > Wide(0)); }

/// The normalised midpoint of two directions. Both are above the surface, and so is every direction between them.
Vec3<Wide> between(const Vec3<Wide>& a, const Vec3<Wide>& b) { return normalize((a + b) * Wide(0.5)); }

}  // namespace

std::optional<std::string> find_dark_place(const Model& model, const ParamValues& values, int pairs, Random& random) {
  const BoundModel bound = bind_model(model, values);
  std::unique_ptr<Brdf<Wide>> wide;
  // Bisection is slow: a model that underflows in many places must show a true zero within the first few.
  constexpr int kTries = 6, kBisections = 108;
  int tries = 0;
  for (const auto& [wi, wo] : direction_pairs(*bound.brdf, pairs, random)) {
    const Rgb<double> f = bound.brdf->eval(wi, wo);
    if (f.r > 0 && f.g > 0 && f.b > 0) continue;
    if (++tries > kTries) break;
    if (!wide) wide = model.make_wide(values);
    const Vec3<Wide> view = Vec3<Wide>::from(wo);
    Vec3<Wide> dark = Vec3<Wide>::from(wi), light;
    if (!is_black(wide->eval(dark, view))) continue;
    bool found = false;
    for (int k = 0; k < 16 && !found; ++k) {
      const Vec3<double> w = k % 2 ? uniform_direction(random) : bound.brdf->sample(wo, uniform_cube(random)).wi;
      light = Vec3<Wide>::from(w);
      found = w.z > 0 && !is_black(wide->eval(light, view));
    }
    if (!found) continue;
    Rgb<Wide> last = wide->eval(light, view);
    for (int k = 0; k < kBisections; ++k) {
      const Vec3<Wide> middle = between(light, dark);
      const Rgb<Wide> value = wide->eval(middle, view);
      if (is_black(value))
        dark = middle;
      else
        light = middle, last = value;
    }
    // 2^-14000; the smallest number is 2^-16382.
    Wide far_from_underflow = Wide(0x1p-1000);
    for (int k = 1; k < 14; ++k) far_from_underflow *= Wide(0x1p-1000);
    if (minimum(last.r, minimum(last.g, last.b)) > far_from_underflow)
      return fmt::format("{} wi={} wo={}", bound.label, text(wi), text(wo));
  }
  return std::nullopt;
}

Edge sharpest_edge(const BoundModel& bound, int arcs, Random& random) {
  const Brdf<double>& brdf = *bound.brdf;
  constexpr int kCoarse = 32, kFine = 8, kCandidates = 3;
  // Radians: wide enough to keep rounding out of the slopes. At a width of 1e-7 the slopes of lobes whose width is
  // 0.001 changed by 0.5 % from curvature alone where light and view graze the surface.
  constexpr double kFinest = 1e-8;
  Edge worst;
  for (int arc = 0; arc < arcs; ++arc) {
    Vec3<double> wo = uniform_direction(random), wi = uniform_direction(random);
    if (const Sample<double> s = brdf.sample(wo, uniform_cube(random)); arc % 2 == 0 && s.pdf > 0) wi = s.wi;
    const auto tangent = [&](const Vec3<double>& w) {
      Vec3<double> t = cross(w, normalize(uniform_direction(random) - Vec3<double>{0, 0, 0.5}));
      return normalize(t);
    };
    const Vec3<double> ti = tangent(wi), to = tangent(wo);
    const auto at = [](const Vec3<double>& w, const Vec3<double>& t, double a) {
      return w * std::cos(a) + t * std::sin(a);
    };
    double reach = 0.6;
    const auto above = [&](double a) { return at(wi, ti, a).z > 1e-3 && at(wo, to, a).z > 1e-3; };
    while (reach > 0.02 && !(above(reach) && above(-reach))) reach *= 0.7;
    if (reach <= 0.02) continue;
    const auto f = [&](double a) { return sum(brdf.eval(at(wi, ti, a), at(wo, to, a))); };

    double height = 0, steepest = 0;
    struct Kink {
      double at, jump;
    };
    // Differences of neighbouring slopes on a grid.
    const auto kinks = [&](double from, double to_, int pieces) {
      const double h = (to_ - from) / pieces;
      std::vector<Kink> out;
      double before = f(from), slope_before = 0;
      height = std::max(height, before);
      for (int i = 1; i <= pieces; ++i) {
        const double value = f(from + i * h), slope = (value - before) / h;
        height = std::max(height, value);
        steepest = std::max(steepest, std::abs(slope));
        if (i > 1) out.push_back({from + (i - 1) * h, std::abs(slope - slope_before)});
        before = value;
        slope_before = slope;
      }
      std::sort(out.begin(), out.end(), [](const Kink& a, const Kink& b) { return a.jump > b.jump; });
      return out;
    };
    const std::vector<Kink> coarse = kinks(-reach, reach, kCoarse);
    Kink sharpest{0, 0};
    for (int c = 0; c < kCandidates; ++c) {
      Kink k = coarse[std::size_t(c)];
      // A jump of the derivative keeps its size as the interval shrinks; the effect of curvature fades.
      for (double h = 2 * reach / kCoarse; h > kFinest; h = 2 * h / kFine) k = kinks(k.at - h, k.at + h, kFine)[0];
      if (k.jump > sharpest.jump) sharpest = k;
    }
    // Numbers below that have few digits, and their differences jump.
    constexpr double kDark = 1e-290;
    const double scale = std::max(height, steepest);
    const double jump = scale > kDark ? sharpest.jump / scale : 0;
    if (jump > worst.jump)
      worst = {jump, fmt::format("{} wi={} wo={}", bound.label, text(at(wi, ti, sharpest.at)),
                                 text(at(wo, to, sharpest.at)))};
  }
  return worst;
}

Weights sampled_weights(const BoundModel& bound, const Vec3<double>& wo, int samples, Random& random) {
  std::array<double, 3> least, most, mean{}, square{};
  least.fill(std::numeric_limits<double>::infinity());
  most.fill(0);
  Weights out;
  for (int i = 0; i < samples; ++i) {
    const Sample<double> s = bound.brdf->sample(wo, uniform_cube(random));
    require_value(s.weight, "weight", bound.label, s.wi, wo);
    if (!(s.pdf > 0)) continue;
    ++out.kept;
    const auto w = channels(s.weight);
    for (std::size_t c = 0; c < 3; ++c) {
      least[c] = std::min(least[c], w[c]);
      most[c] = std::max(most[c], w[c]);
      mean[c] += w[c] / samples;
      square[c] += w[c] * w[c] / samples;
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(most[c] > 0)) continue;
    out.spread = std::max(out.spread, (most[c] - least[c]) / most[c]);
    out.variance = std::max(out.variance, square[c] / (mean[c] * mean[c]) - 1);
  }
  return out;
}

std::optional<double> unevenness(const Brdf<double>& brdf, int pairs, Random& random) {
  std::array<double, 3> least, most{};
  least.fill(std::numeric_limits<double>::infinity());
  for (int i = 0; i < pairs; ++i) {
    const Vec3<double> wo = uniform_direction(random);
    const auto add = [&](const Vec3<double>& wi) {
      const auto f = channels(brdf.eval(wi, wo));
      for (std::size_t c = 0; c < 3; ++c) {
        least[c] = std::min(least[c], f[c]);
        most[c] = std::max(most[c], f[c]);
      }
    };
    add(uniform_direction(random));
    // Directions of the model's own find a lobe that is too narrow for uniform ones.
    if (const Sample<double> s = brdf.sample(wo, uniform_cube(random)); s.pdf > 0) add(s.wi);
  }
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    if (!(most[c] > 0)) return std::nullopt;
    worst = std::max(worst, (most[c] - least[c]) / most[c]);
  }
  return worst;
}

std::optional<double> least_mirror_share(const Brdf<double>& brdf, int samples, Random& random) {
  std::optional<double> least;
  for (const double c : {0.95, 0.7, 0.4}) {
    const Vec3<double> wo = direction(c, 2 * kPi * uniform(random)), r = {-wo.x, -wo.y, wo.z};
    double all = sum(brdf.mirror(wo)), near = all;
    for (int i = 0; i < samples; ++i) {
      const Sample<double> s = brdf.sample(wo, uniform_cube(random));
      if (!(s.pdf > 0)) continue;
      const double w = sum(s.weight) / samples;
      all += w;
      if (length(s.wi - r) < 0.05) near += w;
    }
    if (!(all > 0)) return std::nullopt;
    least = std::min(least.value_or(1), near / all);
  }
  return least;
}

std::optional<double> grazing_anisotropy(const BoundModel& bound) {
  constexpr double kDegree = kPi / 180, kWidest = 8 * kDegree;
  constexpr int kPoints = 64;
  // For models with a tangent, averaged over the azimuth of the view.
  constexpr int kViews = 8;
  double total = 0;
  for (int view = 0; view < kViews; ++view) {
    const Vec3<double> wo = direction(std::cos(80 * kDegree), 2 * kPi * (view + 0.5) / kViews);
    const Vec3<double> r = {-wo.x, -wo.y, wo.z};
    const Vec3<double> across = normalize(cross(Vec3<double>{0, 0, 1}, r)), up = cross(r, across);
    const auto on_cone = [&](double angle, int i) {
      const double a = 2 * kPi * i / kPoints;
      return sum(
          bound.brdf->eval(r * std::cos(angle) + (across * std::cos(a) + up * std::sin(a)) * std::sin(angle), wo));
    };
    const auto mean = [&](double angle) {
      double m = 0;
      for (int i = 0; i < kPoints; ++i) m += on_cone(angle, i) / kPoints;
      return m;
    };
    const double peak = sum(bound.brdf->eval(r, wo));
    if (!(peak > 0)) return std::nullopt;
    double low = 1e-9, high = kWidest;
    if (mean(kWidest) < 0.5 * peak)
      for (int k = 0; k < 60; ++k) {
        const double middle = std::sqrt(low * high);
        (mean(middle) < 0.5 * peak ? high : low) = middle;
      }
    double least = std::numeric_limits<double>::infinity(), most = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double f = on_cone(high, i);
      least = std::min(least, f);
      most = std::max(most, f);
    }
    total += (most - least) / (most + least) / kViews;
  }
  return total;
}

ModelFacts measure_facts(const Model& model) {
  ParamValues white;
  for (const ParamInfo& p : model.info().params)
    if (p.kind == ParamKind::Color) white[p.name] = 1.;
  const BoundModel bound = bind_model(model, white);
  ModelFacts facts;
  Random random(1);
  const Vec3<double> oblique = direction(std::sqrt(0.5), 0.3);
  const Weights w = sampled_weights(bound, oblique, 1 << 15, random);
  facts.scatters = model.has_scatter();
  facts.variance = w.variance;
  const double c = std::cos(80 * kPi / 180);
  facts.reflected =
      max_component(sampled_albedo(*bound.brdf, c, 0.3, bound.label).scattered + bound.brdf->mirror(direction(c, 0.3)));
  facts.anisotropy = grazing_anisotropy(bound);
  return facts;
}

std::string property_table(bool markdown) {
  std::vector<std::vector<std::string>> rows{{"Model", "reciprocal", "conserving", "lossless", "isotropic", "positive",
                                              "smooth", "exact sampling", "matte at", "mirror at", "reflects at 80°",
                                              "variance", "anisotropy at 80°"}};
  const auto small = [](double v) { return v < 5e-4 ? std::string("0") : fmt::format("{:.2g}", v); };
  for (const auto& [name, model] : models()) {
    const ModelProperties& p = model->info().properties;
    const ModelFacts facts = measure_facts(*model);
    const auto yes = [](bool v) { return std::string(v ? "yes" : "no"); };
    const auto of_lobe = [&](const std::string& v) { return facts.scatters ? v : std::string("-"); };
    const auto limit = [&](const std::string& v) {
      return v.empty() ? std::string("-") : markdown ? "`" + v + "`" : v;
    };
    rows.push_back({markdown ? "`" + name + "`" : name, yes(p.reciprocal), yes(p.conserving), yes(p.lossless),
                    yes(p.isotropic), of_lobe(yes(p.positive)), of_lobe(yes(p.smooth)), of_lobe(yes(p.exact_sampling)),
                    limit(p.diffuse_limit), limit(p.specular_limit), fmt::format("{:.3f}", facts.reflected),
                    of_lobe(small(facts.variance)), facts.anisotropy ? small(*facts.anisotropy) : "-"});
  }
  std::string out;
  if (markdown) {
    for (std::size_t i = 0; i < rows.size(); ++i) {
      out += fmt::format("| {} |\n", join(rows[i], " | "));
      if (i == 0)
        out += "|---" + std::string() + [&] {
          std::string rule;
          for (std::size_t k = 1; k < rows[0].size(); ++k) rule += "|---";
          return rule + "|\n";
        }();
    }
    return out;
  }
  // The width in columns: a degree sign has two bytes but takes one column.
  const auto width = [](const std::string& s) {
    return std::size_t(std::count_if(s.begin(), s.end(), [](char c) { return (c & 0xC0) != 0x80; }));
  };
  std::vector<std::size_t> widths(rows[0].size(), 0);
  for (const auto& row : rows)
    for (std::size_t k = 0; k < row.size(); ++k) widths[k] = std::max(widths[k], width(row[k]));
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t k = 0; k < row.size(); ++k) line += row[k] + std::string(widths[k] - width(row[k]) + 2, ' ');
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
  return out;
}

}  // namespace brdfc::measure
