// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/stability.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "measure/bound_model.h"
#include "model/inputs.h"
#include "model/sampling.h"
#include "trace/program.h"

namespace brdfc::measure {
namespace {

template <class T> std::unique_ptr<Brdf<T>> make(const Model& m, const ParamValues& v) {
  if constexpr (std::same_as<T, float>)
    return m.make_float(v);
  else if constexpr (std::same_as<T, double>)
    return m.make_double(v);
  else
    return m.make_wide(v);
}

/// The same model in two scalar types. The parameters are first rounded to the narrower type, so that both get the same
/// values.
template <class Narrow, class Better> class Pair {
 public:
  Pair(const Model& model, ParamValues values) : model_(model), values_(std::move(values)) {
    for (const ParamInfo& p : model.info().params) {
      ParamValue& v = values_[p.name];
      if (p.kind == ParamKind::Number) v = std::clamp(double(Narrow(std::get<double>(v))), p.min, p.max);
      if (p.kind == ParamKind::Color)
        for (double& c : std::get<std::array<double, 3>>(v)) c = double(Narrow(c));
    }
    narrow_ = make<Narrow>(model, values_);
    better_ = make<Better>(model, values_);
    two_sided_ = two_sided(model, *narrow_);
  }

  const ParamValues& values() const { return values_; }

  /// Adds the errors at one pair of directions to `out`. Returns the amplified error.
  double judge(const Vec3<double>& wi_double, const Vec3<double>& wo_double, Stability& out) {
    const Vec3<Narrow> wi = Vec3<Narrow>::from(wi_double), wo = Vec3<Narrow>::from(wo_double);
    if (wi.z == Narrow(0) || wo.z == Narrow(0)) return 0;
    if (!two_sided_ && !(wi.z > Narrow(0) && wo.z > Narrow(0))) return 0;
    const Vec3<Better> bi = normalize(Vec3<Better>::from(wi)), bo = normalize(Vec3<Better>::from(wo));
    const Rgb<double> got = to_double(value_of(model_, *narrow_, wi, wo));
    const auto where = [&] {
      return fmt::format("{} {} wi={} wo={}", model_.info().name, format_values(model_.info(), values_),
                         text(to_double(wi), 17), text(to_double(wo), 17));
    };
    if (!(got.r >= 0 && got.g >= 0 && got.b >= 0 && std::isfinite(got.r + got.g + got.b)))
      require_value(got, std::same_as<Narrow, float> ? "f in float" : "f",
                    model_.info().name + " " + format_values(model_.info(), values_), to_double(wi), to_double(wo));
    ++out.points;
    const double eps = double(std::numeric_limits<Narrow>::epsilon());
    const Rgb<Better> raw = value_of(model_, *better_, bi, bo);
    // Channels that underflow in the narrow type carry no light and are ignored.
    keep_ = {1, 1, 1};
    const auto vanishes = [&](const Better& v) { return double(v) < double(std::numeric_limits<Narrow>::min()) / eps; };
    if (vanishes(raw.r)) keep_.r = 0;
    if (vanishes(raw.g)) keep_.g = 0;
    if (vanishes(raw.b)) keep_.b = 0;
    const Rgb<Better> truth = kept(raw);
    const double error = relative(kept(Rgb<Better>{Better(got.r), Better(got.g), Better(got.b)}), truth);
    if (error > out.relative) out.relative = error, out.where = where();
    // The condition number is at least 0, so it need not be computed at most places.
    if (error <= eps * std::max(out.amplified, 0.5)) return error / eps;
    const double amplified = error / (eps * (1 + condition(bi, bo, truth)));
    if (amplified > out.amplified) out.amplified = amplified, out.amplified_where = where();
    return amplified;
  }

 private:
  Rgb<Better> kept(const Rgb<Better>& c) const {
    return {c.r * Better(keep_.r), c.g * Better(keep_.g), c.b * Better(keep_.b)};
  }

  double condition(const Vec3<Better>& wi, const Vec3<Better>& wo, const Rgb<Better>& truth) {
    const double eps = double(std::numeric_limits<Narrow>::epsilon());
    const Better up = Better(1) + Better(eps), down = Better(1) - Better(eps);
    double sum = 0;
    const auto larger = [&](const Rgb<Better>& a, const Rgb<Better>& b) {
      sum += std::max(relative(kept(a), truth), relative(kept(b), truth)) / eps;
    };
    for (int k = 0; k < 6; ++k) {
      const auto moved = [&](const Better& factor) {
        Vec3<Better> i = wi, o = wo;
        Vec3<Better>& w = k < 3 ? i : o;
        (k % 3 == 0 ? w.x : k % 3 == 1 ? w.y : w.z) *= factor;
        return value_of(model_, *better_, normalize(i), normalize(o));
      };
      larger(moved(up), moved(down));
    }
    if (nudged_.empty())
      for (const ParamInfo& p : model_.info().params) {
        if (p.kind != ParamKind::Number) continue;
        for (const double factor : {1 + eps, 1 - eps}) {
          ParamValues v = values_;
          v[p.name] = std::clamp(std::get<double>(v[p.name]) * factor, p.min, p.max);
          nudged_.push_back(make<Better>(model_, v));
        }
      }
    for (std::size_t k = 0; k + 1 < nudged_.size(); k += 2)
      larger(value_of(model_, *nudged_[k], wi, wo), value_of(model_, *nudged_[k + 1], wi, wo));
    return sum;
  }

  const Model& model_;
  ParamValues values_;
  bool two_sided_ = false;
  Rgb<double> keep_;  // 1 or 0: channels that are compared
  std::unique_ptr<Brdf<Narrow>> narrow_;
  std::unique_ptr<Brdf<Better>> better_;
  std::vector<std::unique_ptr<Brdf<Better>>> nudged_;
};

template <class Narrow, class Better>
Stability stability(const Model& model, const ParamValues& values, int points, std::uint64_t seed) {
  Random random(seed);
  Pair<Narrow, Better> pair(model, complete(model.info(), values));
  Stability out;
  const auto guide = model.make_double(pair.values());
  for (const auto& [wi, wo] : direction_pairs(*guide, points, random, two_sided(model, *guide)))
    pair.judge(wi, wo, out);
  return out;
}

/// A number in [low, high] whose floating-point ordinal is uniform: as many numbers between 1e-9 and 1e-8 as between 1
/// and 10.
double ordinal_uniform(double low, double high, Random& random) {
  if (!(high > low)) return low;
  if (low < 0) {
    // Positive and negative numbers with equal probability.
    const double magnitude = ordinal_uniform(0, std::max(-low, high), random);
    return std::clamp(random() & 1 ? magnitude : -magnitude, low, high);
  }
  // A quarter of all numbers in [0, 1] is below 1e-300, and formulas treat them all alike: one in 16 samples suffices.
  if (low == 0 && random() % 16 != 0) low = std::min(1e-20, high * 1e-20);
  const auto a = std::bit_cast<std::uint64_t>(low), b = std::bit_cast<std::uint64_t>(high);
  return std::bit_cast<double>(a + std::uniform_int_distribution<std::uint64_t>(0, b - a)(random));
}

Vec3<double> ordinal_direction(Random& random) {
  const double phi = 2 * kPi * uniform(random), small = ordinal_uniform(1e-12, 1, random);
  const double large = std::sqrt((1 - small) * (1 + small));
  // Every second direction takes its ordinals from the angle to the normal.
  return random() & 1 ? Vec3<double>{large * std::cos(phi), large * std::sin(phi), small}
                      : Vec3<double>{small * std::cos(phi), small * std::sin(phi), std::max(large, 1e-12)};
}

Vec3<double> close_to(const Vec3<double>& w, Random& random) {
  const double step = ordinal_uniform(1e-12, 1, random);
  const Vec3<double> v = uniform_direction(random) - Vec3<double>{0, 0, 0.5};
  Vec3<double> moved = normalize(w + v * step);
  return moved.z > 0 ? moved : w;
}

ParamValues anywhere(const ModelInfo& info, const std::vector<ParamValues>& usual, Random& random) {
  ParamValues v = usual[random() % usual.size()];
  if (random() & 1) return v;
  for (const ParamInfo& p : info.params) {
    if (p.kind == ParamKind::Number) {
      const auto kind = random() % 8;
      v[p.name] = kind == 0 ? p.min : kind == 1 ? p.max : ordinal_uniform(p.min, p.max, random);
    }
    if (p.kind == ParamKind::Color)
      for (double& c : std::get<std::array<double, 3>>(v[p.name]))
        c = random() % 8 == 0 ? double(random() & 1) : ordinal_uniform(0, 1, random);
  }
  return v;
}

/// Pairs of directions at which formulas tend to fail: near and at the mirror direction, backscattering, opposite
/// directions, and the normal.
std::array<Vec3<double>, 2> above_surface(const Brdf<double>& brdf, Random& random) {
  const Vec3<double> wo = random() % 16 == 0 ? Vec3<double>{0, 0, 1} : ordinal_direction(random);
  const Vec3<double> mirror{-wo.x, -wo.y, wo.z};
  switch (random() % 8) {
    case 0:
      return {mirror, wo};
    case 1:
      return {wo, wo};
    case 2:
      return {close_to(mirror, random), wo};
    case 3:
      return {close_to(wo, random), wo};
    case 4: {  // in the plane of incidence
      const Vec3<double> w = ordinal_direction(random);
      const double s = std::hypot(w.x, w.y), so = std::hypot(wo.x, wo.y);
      if (!(so > 0)) return {w, wo};
      const double sign = random() & 1 ? s / so : -s / so;
      return {Vec3<double>{wo.x * sign, wo.y * sign, w.z}, wo};
    }
    case 5:
      return {ordinal_direction(random), wo};
    default: {
      const Sample<double> s = brdf.sample(wo, uniform_cube(random));
      return {s.pdf > 0 && s.wi.z > 0 ? s.wi : uniform_direction(random), wo};
    }
  }
}

/// The same on both sides of the surface where views from inside are allowed, and pairs close to ideal refraction.
std::array<Vec3<double>, 2> anywhere(const Brdf<double>& brdf, bool two_sided, Random& random) {
  auto pair = above_surface(brdf, random);
  if (!two_sided) return pair;
  for (Vec3<double>& w : pair)
    if (random() & 1) w.z = -w.z;
  auto& [wi, wo] = pair;
  if (random() % 4 == 0) {
    const Vec3<double> w = refract(wo, brdf.ior());
    if (w.z != 0) wi = w;
    if (random() & 1) {
      const Vec3<double> up = close_to({wi.x, wi.y, std::abs(wi.z)}, random);
      wi = {up.x, up.y, std::copysign(up.z, wi.z)};
    }
  } else if (random() % 4 == 0) {
    const Sample<double> s = brdf.sample(wo, uniform_cube(random));
    if (s.pdf > 0 && s.wi.z != 0) wi = s.wi;
  }
  return pair;
}

}  // namespace

Stability float_stability(const Model& m, const ParamValues& v, int points, std::uint64_t seed) {
  return stability<float, double>(m, v, points, seed);
}
Stability double_stability(const Model& m, const ParamValues& v, int points, std::uint64_t seed) {
  return stability<double, Wide>(m, v, points, seed);
}

Stability hunt_rounding(const Model& model, const Hunt& hunt) {
  const ModelInfo& info = model.info();
  Random random(hunt.seed);
  const std::vector<ParamValues> usual = slider_cases(info, 3, hunt.seed), ends = end_cases(info, false);
  Stability out;
  struct Spot {
    double amplified;
    ParamValues values;
    std::array<Vec3<double>, 2> w;
  };
  std::vector<Spot> spots;
  const auto visit = [&](const ParamValues& values, int pairs) {
    Pair<double, Wide> pair(model, values);
    const auto guide = model.make_double(pair.values());
    for (int k = 0; k < pairs; ++k) {
      const auto w = anywhere(*guide, two_sided(model, *guide), random);
      const double before = out.amplified;
      const double amplified = pair.judge(w[0], w[1], out);
      if (out.amplified > before) {
        spots.push_back({amplified, pair.values(), w});
        if (int(spots.size()) > hunt.climbs) spots.erase(spots.begin());
      }
    }
  };
  constexpr int kPairs = 16;
  for (const ParamValues& v : ends) visit(v, 4 * kPairs);
  while (out.points < hunt.points) {
    const long before = out.points;
    visit(anywhere(info, usual, random), kPairs);
    if (out.points == before) break;
  }
  for (const Spot& start : spots) {
    Spot here = start;
    for (int k = 0; k < hunt.steps; ++k) {
      const double step = std::pow(10, -1 - 12 * uniform(random));
      Spot next = here;
      if (random() % 3 == 0)
        for (const ParamInfo& p : info.params)
          if (p.kind == ParamKind::Number)
            next.values[p.name] = std::clamp(
                std::get<double>(here.values[p.name]) * (1 + step * (2 * uniform(random) - 1)), p.min, p.max);
      Vec3<double>& w = next.w[random() & 1];
      w = normalize(Vec3<double>{w.x + step * (uniform(random) - 0.5), w.y + step * (uniform(random) - 0.5),
                                 w.z * (1 + step * (uniform(random) - 0.5))});
      Stability alone;
      Pair<double, Wide> pair(model, next.values);
      pair.judge(next.w[0], next.w[1], alone);
      next.amplified = alone.amplified;
      ++out.points;
      if (next.amplified > here.amplified) here = next;
      if (alone.amplified > out.amplified) out.amplified = alone.amplified, out.amplified_where = alone.amplified_where;
    }
  }
  return out;
}

long evaluate_everywhere(const Model& model, long calls, std::uint64_t seed) {
  const ModelInfo& info = model.info();
  Random random(seed);
  const std::vector<ParamValues> usual = slider_cases(info, 3, seed);
  constexpr int kPairs = 64;
  long done = 0;
  while (done < calls) {
    const BoundModel bound = bind_model(model, anywhere(info, usual, random));
    const auto single = model.make_float(bound.values);
    for (int k = 0; k < kPairs; ++k) {
      const auto [wi, wo] = anywhere(*bound.brdf, two_sided(model, *bound.brdf), random);
      const Vec3<float> fi = Vec3<float>::from(wi), fo = Vec3<float>::from(wo);
      require_value(bound.brdf->eval(wi, wo), "f", bound.label, wi, wo);
      require_value(bound.brdf->pdf(wi, wo), "pdf", bound.label, wi, wo);
      require_value(to_double(single->eval(fi, fo)), "f in float", bound.label, wi, wo);
      require_value(double(single->pdf(fi, fo)), "pdf in float", bound.label, wi, wo);
      Vec3<double> u = uniform_cube(random);
      for (double* v : {&u.x, &u.y, &u.z}) {
        if (const auto kind = random() % 16; kind == 0)
          *v = 0;
        else if (kind == 1)
          *v = 1 - 0x1p-53;
        else if (kind == 2)
          *v = ordinal_uniform(0, 0.5, random);
      }
      const Sample<double> s = bound.brdf->sample(wo, u);
      require_value(s.weight, "weight", bound.label, s.wi, wo);
      require_value(s.pdf, "pdf", bound.label, s.wi, wo);
      Vec3<float> v = Vec3<float>::from(u);
      for (float* c : {&v.x, &v.y, &v.z}) *c = std::min(*c, 1 - 0x1p-24f);
      const Sample<float> t = single->sample(fo, v);
      require_value(to_double(t.weight), "weight in float", bound.label, to_double(t.wi), wo);
      require_value(double(t.pdf), "pdf in float", bound.label, to_double(t.wi), wo);
      require_value(bound.brdf->mirror(wo), "mirror", bound.label, wi, wo);
      require_value(bound.brdf->transmit(wo), "transmit", bound.label, wi, wo);
      require_value(to_double(single->mirror(fo)), "mirror in float", bound.label, wi, wo);
      require_value(to_double(single->transmit(fo)), "transmit in float", bound.label, wi, wo);
      done += 10;
    }
  }
  return done;
}

std::map<int, SinglePrecision> single_precision_by_decade(const Model& model, int cases, int samples,
                                                          std::uint64_t seed) {
  std::map<int, SinglePrecision> out;
  if (!model.has_scatter()) return out;
  const ModelInfo& info = model.info();
  Random random(seed);
  const std::vector<ParamValues> usual = slider_cases(info, 0, seed);
  for (int i = 0; i < cases; ++i) {
    ParamValues values = usual[std::size_t(i) % usual.size()], choices;
    double largest = 0;
    for (const ParamInfo& p : info.params) {
      if (p.kind == ParamKind::Choice) choices[p.name] = values[p.name];
      if (p.kind != ParamKind::Number) continue;
      const double low = std::max(p.min, std::min(1., p.max)), high = std::min(p.max, 1e7);
      const double v = low > 0 && high > low ? low * std::pow(high / low, uniform(random)) : p.value[0];
      values[p.name] = double(float(v));
      largest = std::max(largest, std::abs(v));
    }
    const auto exact = model.make_double(values);
    const auto single = model.make_float(values);
    Recorder recorder;
    const auto recorded = model.record(choices);
    Program program;
    program.output("f", recorded->eval(input3("wi"), input3("wo")));
    Inputs<float> inputs;
    set_inputs(inputs, values);
    double all = 0, native = 0, printed = 0, inherent = 0;
    const Vec3<double> wo = direction(0.1 + 0.9 * uniform(random), 2 * kPi * uniform(random));
    const Vec3<float> fo = Vec3<float>::from(wo);
    const Vec3<double> same_wo = normalize(Vec3<double>::from(fo));
    for (int k = 0; k < samples; ++k) {
      const Sample<double> s = exact->sample(wo, uniform_cube(random));
      const Vec3<float> fi = Vec3<float>::from(s.wi);
      if (!(s.pdf > 0) || !(fi.z > 0)) continue;
      const Rgb<double> truth = exact->eval(normalize(Vec3<double>::from(fi)), same_wo);
      const Rgb<float> a = single->eval(fi, fo);
      set_input(inputs, "wi", fi);
      set_input(inputs, "wo", fo);
      const auto b = program.run<float>(inputs).at("f");
      const double weight = s.wi.z / s.pdf;
      const Rgb<double> unrounded = exact->eval(s.wi, wo);
      inherent += weight *
                  (std::abs(unrounded.r - truth.r) + std::abs(unrounded.g - truth.g) + std::abs(unrounded.b - truth.b));
      all += weight * (truth.r + truth.g + truth.b);
      native += weight * (std::abs(a.r - truth.r) + std::abs(a.g - truth.g) + std::abs(a.b - truth.b));
      printed += weight * (std::abs(b[0] - truth.r) + std::abs(b[1] - truth.g) + std::abs(b[2] - truth.b));
    }
    if (!(all > 0)) continue;
    SinglePrecision& row = out[largest >= 1 ? int(std::floor(std::log10(largest) + 1e-9)) : 0];
    ++row.cases;
    if (std::max(native, printed) / all > std::max(row.native, row.recorded))
      row.where = fmt::format("{} {} wo={}", info.name, format_values(info, values), text(wo));
    row.inherent = std::max(row.inherent, inherent / all);
    row.native = std::max(row.native, native / all);
    row.recorded = std::max(row.recorded, printed / all);
  }
  return out;
}

}  // namespace brdfc::measure
