// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/terms.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>

#include "measure/probes.h"

namespace brdfc::fit {
namespace {

using Powers = std::vector<int>;  ///< the exponent of each parameter

constexpr double kTolerance = 1e-9;
/// Replaces 0 for a term that is proportional to a colour there, where f would vanish.
constexpr double kNearlyNone = 1e-6;
constexpr double kLeastReflected = 0.02;
constexpr std::size_t kMaxParameters = 8;

bool may_be_any_share(const ParamInfo& p) {
  return p.kind == ParamKind::Color || (p.kind == ParamKind::Number && p.min <= 0 && p.max >= 1);
}

/// Pairs of directions; in some of them the light direction is sampled from the model with these parameters.
std::vector<std::array<Vec3<double>, 2>> pairs(const Model& model, const ParamValues& values, int count) {
  measure::Random random(12);
  return measure::direction_pairs(*model.make_double(values), count, random, model.two_sided());
}

/// The degree of f in parameter p, for any values of the other open parameters: 0, 1 or 2; 3 if it is none of these.
int degree(const Model& model, const std::vector<ParamValues>& places, const ParamInfo& p,
           const std::vector<const ParamInfo*>& open) {
  int degree = 0;
  measure::Random random(5);
  for (ParamValues values : places) {
    for (const ParamInfo* other : open)
      values[other->name] =
          as_value(*other, {measure::uniform(random), measure::uniform(random), measure::uniform(random)});
    const auto with = [&](const Rgb<double>& c) {
      values[p.name] = as_value(p, c);
      return model.make_double(values);
    };
    std::vector<std::unique_ptr<Brdf<double>>> steps;
    for (int k = 0; k <= 4; ++k) steps.push_back(with(Rgb<double>(k / 4.0)));
    const auto coloured = with({0, 0.5, 1});
    for (const auto& [wi, wo] : pairs(model, values, 128)) {
      std::vector<Rgb<double>> f;
      for (const auto& brdf : steps) f.push_back(brdf->eval(wi, wo));
      double scale = 0;
      for (const Rgb<double>& v : f) scale = std::max(scale, max_component(magnitude(v)));
      const auto vanishes = [&](const Rgb<double>& v) { return max_component(magnitude(v)) <= kTolerance * scale; };
      if (!vanishes(f[4] - f[0])) degree = std::max(degree, 1);
      for (std::size_t k = 0; k < 3; ++k)
        if (!vanishes(f[k + 2] - f[k + 1] * 2.0 + f[k])) degree = 2;
      for (std::size_t k = 0; k < 2; ++k)
        if (!vanishes(f[k + 3] - f[k + 2] * 3.0 + f[k + 1] * 3.0 - f[k])) return 3;
      const Rgb<double> each = coloured->eval(wi, wo);
      if (p.kind == ParamKind::Color && !vanishes(each - Rgb<double>{f[0].r, f[2].g, f[4].b})) return 3;
    }
  }
  return degree;
}

/// All combinations of powers up to the given degrees; the first parameter varies slowest.
std::vector<Powers> all_powers(const Powers& degrees) {
  std::vector<Powers> out = {{}};
  for (const int d : degrees) {
    std::vector<Powers> longer;
    for (const Powers& p : out)
      for (int e = 0; e <= d; ++e) {
        longer.push_back(p);
        longer.back().push_back(e);
      }
    out = std::move(longer);
  }
  return out;
}

/// The products of powers that occur in f.
std::set<Powers> powers_in(const Model& model, const std::vector<ParamValues>& places,
                           const std::vector<const ParamInfo*>& open, const Powers& degrees) {
  const std::vector<Powers> all = all_powers(degrees);
  std::set<Powers> out;
  for (const ParamValues& place : places) {
    // f at the nodes 0, 1 or 0, 1/2, 1 of each parameter.
    std::vector<std::unique_ptr<Brdf<double>>> nodes;
    ParamValues values = place;
    for (const Powers& powers : all) {
      for (std::size_t i = 0; i < open.size(); ++i)
        values[open[i]->name] = as_value(*open[i], Rgb<double>(double(powers[i]) / degrees[i]));
      nodes.push_back(model.make_double(values));
    }
    for (const ParamInfo* p : open) values[p->name] = as_value(*p, Rgb<double>(0.5));
    for (const auto& [wi, wo] : pairs(model, values, 256)) {
      std::vector<Rgb<double>> c;
      for (const auto& brdf : nodes) c.push_back(brdf->eval(wi, wo));
      double scale = 0;
      for (const Rgb<double>& v : c) scale = std::max(scale, max_component(magnitude(v)));
      // Converts values to coefficients, one parameter after the other.
      std::size_t stride = c.size();
      for (const int d : degrees) {
        const std::size_t block = stride;
        stride /= std::size_t(d + 1);
        for (std::size_t first = 0; first < c.size(); first += block)
          for (std::size_t i = first; i < first + stride; ++i) {
            const Rgb<double> at0 = c[i], at1 = c[i + stride];
            if (d == 1) {
              c[i + stride] = at1 - at0;
            } else {
              const Rgb<double> at2 = c[i + 2 * stride];
              c[i + stride] = at1 * 4.0 - at0 * 3.0 - at2;
              c[i + 2 * stride] = (at0 + at2) * 2.0 - at1 * 4.0;
            }
          }
      }
      for (std::size_t i = 0; i < all.size(); ++i)
        if (max_component(magnitude(c[i])) > 100 * kTolerance * scale) out.insert(all[i]);
    }
  }
  return out;
}

double product(const std::vector<double>& at, const Powers& powers) {
  double out = 1;
  for (std::size_t i = 0; i < at.size(); ++i) out *= std::pow(at[i], powers[i]);
  return out;
}

/// True if a product has all of these powers and also a power of parameter i.
bool has_more(const std::set<Powers>& products, const Powers& powers, std::size_t i) {
  return std::ranges::any_of(products, [&](const Powers& other) {
    bool all = other[i] > powers[i];
    for (std::size_t k = 0; k < powers.size(); ++k) all = all && other[k] >= powers[k];
    return all;
  });
}

/// Makes a term for each product of powers. The term is f with its parameters at 1 and the others at 0. A parameter of
/// second degree that the term has in the first power only gets a value of nearly 0. The weights of the terms are found
/// by inverting the matrix of the products' values at the terms. Returns nullopt if the value of nearly 0 is not small
/// enough for that.
std::optional<Terms> solved(const std::set<Powers>& products, const std::vector<const ParamInfo*>& open,
                            const Powers& degrees) {
  Terms out;
  out.terms.clear();
  for (const ParamInfo* p : open) out.parameters.push_back(p->name);
  const auto n = Eigen::Index(products.size());
  Eigen::MatrixXd have(n, n);
  Eigen::Index row = 0;
  for (const Powers& powers : products) {
    Terms::Term& term = out.terms.emplace_back();
    std::vector<double> at;
    for (std::size_t i = 0; i < open.size(); ++i) {
      at.push_back(powers[i] == 0 ? 0 : powers[i] == degrees[i] ? 1 : kNearlyNone);
      if (at.back() == kNearlyNone) term.scale *= kNearlyNone;
      term.values[open[i]->name] = as_value(*open[i], Rgb<double>(at.back()));
      const double judged = powers[i] == 0 && has_more(products, powers, i) ? kLeastReflected : at.back();
      term.judged[open[i]->name] = as_value(*open[i], Rgb<double>(judged));
    }
    Eigen::Index column = 0;
    for (const Powers& other : products) have(row, column++) = product(at, other) / term.scale;
    ++row;
  }
  if (have.maxCoeff() > 1 + kTolerance) return std::nullopt;
  const Eigen::MatrixXd undo = have.inverse();
  Eigen::Index of_product = 0;
  for (const Powers& powers : products) {
    for (std::size_t t = 0; t < out.terms.size(); ++t)
      if (const double x = undo(of_product, Eigen::Index(t)); std::abs(x) > 1e-12) out.terms[t].polynomial[powers] = x;
    ++of_product;
  }
  return out;
}

/// Removes terms for which f is black, for example the matte base of a perfect mirror, for which no light is left.
Terms without_black(const Model& model, const std::vector<ParamValues>& places, Terms terms) {
  std::erase_if(terms.terms, [&](const Terms::Term& term) {
    for (ParamValues values : places) {
      const auto seen = pairs(model, values, 256);
      for (const auto& [name, value] : term.values) values[name] = value;
      const auto brdf = model.make_double(values);
      for (const auto& [wi, wo] : seen)
        if (max_component(brdf->eval(wi, wo)) > kTolerance * term.scale) return false;
    }
    return true;
  });
  return terms;
}

bool positive(const Terms& terms, const Powers& degrees) {
  for (const Powers& node : all_powers(Powers(degrees.size(), 2))) {
    std::vector<double> at;
    for (const int k : node) at.push_back(k / 2.0);
    for (const Terms::Term& term : terms.terms) {
      double weight = 0;
      for (const auto& [powers, x] : term.polynomial) weight += x * product(at, powers);
      if (weight < -2 * kNearlyNone) return false;
    }
  }
  return true;
}

/// The terms of f = (x - w) f'(0) + w f(1) for a colour x, with w = c x^2 + (1 - c) x^3, where c is the best for all
/// places. For one reflection f is proportional to x; what is reflected again and again has a weight such as
/// x^2 / (1 - x L), where L is the light that stays each time. nullopt if f is none such.
std::optional<Terms> nearly_polynomial(const Model& model, const std::vector<ParamValues>& places, const ParamInfo& p) {
  constexpr int kSteps = 12;
  const auto sum = [](const Rgb<double>& v) { return v.r + v.g + v.b; };
  /// f less what the terms have with c = 0, and their change with c, at one place.
  struct Seen {
    std::vector<Rgb<double>> off, change;  ///< by step and pair of directions
    std::vector<double> light;             ///< by step
  };
  std::vector<Seen> seen;
  double wanted = 0, have = 0;
  for (ParamValues values : places) {
    const auto with = [&](const Rgb<double>& c) {
      values[p.name] = as_value(p, c);
      return model.make_double(values);
    };
    std::vector<std::unique_ptr<Brdf<double>>> steps;
    for (int k = 0; k <= kSteps; ++k) steps.push_back(with(Rgb<double>(double(k) / kSteps)));
    const auto faint = with(Rgb<double>(kNearlyNone)), coloured = with({0, 0.5, 1});
    const auto where = pairs(model, values, 256);
    Seen& here = seen.emplace_back();
    for (int k = 1; k < kSteps; ++k) {
      const double x = double(k) / kSteps;
      double& light = here.light.emplace_back(0);
      for (const auto& [wi, wo] : where) {
        const Rgb<double> f = steps[std::size_t(k)]->eval(wi, wo), white = steps.back()->eval(wi, wo),
                          once = faint->eval(wi, wo) / kNearlyNone, again = white - once;
        light += sum(magnitude(f));
        here.off.push_back(f - once * x - again * (x * x * x));
        here.change.push_back(again * (x * x - x * x * x));
      }
    }
    double white_light = 0;
    for (const auto& [wi, wo] : where) {
      const Rgb<double> black = steps.front()->eval(wi, wo), half = steps[kSteps / 2]->eval(wi, wo),
                        white = steps.back()->eval(wi, wo), each = coloured->eval(wi, wo);
      const double most = kTolerance * max_component(magnitude(white));
      if (max_component(magnitude(black)) > most) return std::nullopt;
      if (max_component(magnitude(each - Rgb<double>{black.r, half.g, white.b})) > most) return std::nullopt;
      white_light += sum(white);
    }
    if (!(white_light > 0)) return std::nullopt;
    for (std::size_t i = 0; i < here.off.size(); ++i) {
      wanted += sum(here.off[i] * here.change[i]) / sqr(white_light);
      have += sum(here.change[i] * here.change[i]) / sqr(white_light);
    }
  }
  if (!(have > 0)) return std::nullopt;
  const double c = wanted / have;
  if (c < 0 || c > 2) return std::nullopt;  // a weight would be negative
  double most = 0, furthest = 0;
  for (const Seen& here : seen)
    for (std::size_t k = 0; k < here.light.size(); ++k) {
      double off = 0;
      const std::size_t count = here.off.size() / here.light.size();
      for (std::size_t i = k * count; i < (k + 1) * count; ++i)
        off += sum(magnitude(here.off[i] - here.change[i] * c)) / here.light[k];
      if (off > most) most = off, furthest = double(k + 1) / kSteps;
    }
  if (!(most <= kNearlyThere)) return std::nullopt;
  const auto all = [&](double x) { return ParamValues{{p.name, as_value(p, Rgb<double>(x))}}; };
  Terms out;
  out.parameters = {p.name};
  out.terms = {{all(kNearlyNone), kNearlyNone, all(kNearlyNone), {{{1}, 1}, {{2}, -c}, {{3}, c - 1}}},
               {all(1), 1, all(1), {{{2}, c}, {{3}, 1 - c}}}};
  out.furthest = all(furthest);
  return out;
}

/// The closure of the set under the product of two elements, in which each parameter gets the higher of its two powers.
std::set<Powers> closed(std::set<Powers> products) {
  for (std::size_t before = 0; before != products.size();) {
    before = products.size();
    const std::set<Powers> now = products;
    for (const Powers& a : now)
      for (const Powers& b : now) {
        Powers both(a.size());
        std::ranges::transform(a, b, both.begin(), [](int x, int y) { return std::max(x, y); });
        products.insert(std::move(both));
      }
  }
  return products;
}

}  // namespace

Rgb<double> as_rgb(const ParamValue& value) {
  const auto* c = std::get_if<std::array<double, 3>>(&value);
  return c ? Rgb<double>{(*c)[0], (*c)[1], (*c)[2]} : Rgb<double>(std::get<double>(value));
}

ParamValue as_value(const ParamInfo& p, const Rgb<double>& c) {
  return p.kind == ParamKind::Number ? ParamValue(c.r) : ParamValue(std::array<double, 3>{c.r, c.g, c.b});
}

std::vector<ParamValues> places(const Model& model, const ParamValues& known) {
  std::vector<ParamValues> out = {complete(model.info(), known)};
  for (const ParamInfo& p : model.info().params)
    if (!known.count(p.name) && p.kind == ParamKind::Number)
      for (const double end : {p.soft_min, p.soft_max}) {
        out.push_back(out.front());
        out.back()[p.name] = end;
      }
  return out;
}

std::set<std::string> factors(const Model& model, const ParamValues& known) {
  if (!model.has_scatter()) return {};
  std::set<std::string> out;
  for (const ParamInfo& p : model.info().params) {
    if (!may_be_any_share(p)) continue;
    const Rgb<double> colour = p.kind == ParamKind::Number ? Rgb<double>(0.3) : Rgb<double>{0.3, 0.6, 0.8};
    bool proportional = true;
    for (ParamValues values : places(model, known)) {
      values[p.name] = as_value(p, colour);
      const auto of_coloured = model.make_double(values);
      values[p.name] = as_value(p, Rgb<double>(1.0));
      const auto of_white = model.make_double(values);
      for (const auto& [wi, wo] : pairs(model, values, 256))
        proportional =
            proportional && measure::relative(of_white->eval(wi, wo) * colour, of_coloured->eval(wi, wo)) < kTolerance;
    }
    if (proportional) out.insert(p.name);
  }
  return out;
}

Terms terms_of(const Model& model, const ParamValues& known, const std::set<std::string>& factors) {
  if (!model.has_scatter()) return {};
  const ModelInfo& info = model.info();
  const auto is_open = [&](const ParamInfo& p) { return !known.count(p.name) && may_be_any_share(p); };
  if (std::ranges::none_of(info.params, is_open)) return {};
  std::vector<const ParamInfo*> candidates, open;
  for (const ParamInfo& p : info.params)
    if (is_open(p) && !factors.count(p.name)) candidates.push_back(&p);
  const std::vector<ParamValues> asked = places(model, known);
  std::vector<const ParamInfo*> others;  // colours that f is no polynomial of
  Powers degrees;
  for (const ParamInfo* p : candidates) {
    const int d = degree(model, asked, *p, candidates);
    if (d > 2 && p->kind == ParamKind::Color) others.push_back(p);
    if (d == 0 || d > (p->kind == ParamKind::Color ? 2 : 1)) continue;
    open.push_back(p);
    degrees.push_back(d);
  }
  if (open.empty() && others.size() == 1)
    if (const std::optional<Terms> out = nearly_polynomial(model, asked, *others.front())) return *out;
  if (open.empty() || open.size() > kMaxParameters) return {};
  std::set<Powers> products = powers_in(model, asked, open, degrees);
  for (int tries = 0; tries < 2; ++tries) {
    if (products.empty() || products.size() > kMaxTerms) return {};
    const std::optional<Terms> out = solved(products, open, degrees);
    if (!out) return {};
    if (positive(*out, degrees)) return without_black(model, asked, *out);
    products = closed(std::move(products));
  }
  return {};
}

std::vector<ParamValues> Terms::judged() const {
  std::vector<ParamValues> out;
  for (const Term& term : terms) out.push_back(term.judged);
  if (furthest) out.push_back(*furthest);
  return out;
}

bool Terms::has(const std::string& parameter) const {
  return std::ranges::find(parameters, parameter) != parameters.end();
}

template <class T> std::vector<Rgb<T>> Terms::weights(const std::map<std::string, Rgb<T>>& values) const {
  std::vector<Rgb<T>> out;
  for (const Term& term : terms) {
    Rgb<T> sum(T(0));
    for (const auto& [powers, coefficient] : term.polynomial) {
      // Subtracting a part takes less code than adding it with a negative factor.
      Rgb<T> part{T(std::abs(coefficient))};
      for (std::size_t i = 0; i < powers.size(); ++i)
        for (int k = 0; k < powers[i]; ++k) part = part * values.at(parameters[i]);
      sum = coefficient < 0 ? sum - part : sum + part;
    }
    out.push_back(named("weight_of_term", sum));
  }
  return out;
}
template std::vector<Rgb<double>> Terms::weights(const std::map<std::string, Rgb<double>>&) const;
template std::vector<Rgb<Expr>> Terms::weights(const std::map<std::string, Rgb<Expr>>&) const;

}  // namespace brdfc::fit
