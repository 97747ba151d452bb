// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/albedo_polynomial.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "measure/albedo.h"

namespace brdfc::measure {
namespace {

double distance(const Coefficients& a, const Coefficients& b) {
  double d = 0;
  for (std::size_t k = 0; k < a.scattered.size(); ++k)
    d = std::max({d, max_abs(a.scattered[k] - b.scattered[k]), max_abs(a.mirror[k] - b.mirror[k])});
  return d;
}

bool differ(const Coefficients& a, const Coefficients& b) {
  return distance(a, b) > kTableSettings.same + 7 * (a.error + b.error);
}

}  // namespace

double Coordinate::at(double t) const {
  return name == "cos_theta_o" ? range.low + (range.high - range.low) * t * t : range.at(t);
}

Coordinate coordinate_of(const ParamInfo& p) { return {p.name, p.accepted()}; }

double max_abs(const Rgb<double>& c) { return max_component(magnitude(c)); }

double unit_of(const Rgb<double>& albedo) { return std::max(1.0, max_abs(albedo)); }

AlbedoPolynomial::AlbedoPolynomial(const Model& model, const std::vector<ParamValues>& combinations) : model_(model) {
  coordinates_.push_back({"cos_theta_o", {AxisScale::Linear, kTableSettings.min_cos, 1}});
  for (const ParamInfo& p : model.info().params) {
    if (p.kind == ParamKind::Number) coordinates_.push_back(coordinate_of(p));
    if (p.kind == ParamKind::Color) colors_.push_back(p.name);
  }
  if (colors_.size() > 5)
    throw ValueError(
        fmt::format("{}: expected at most 5 colours in an albedo table, got {}", model.info().name, colors_.size()));
  study_degrees(combinations);
  study_channels(combinations);
  study_azimuth(combinations);
}

void AlbedoPolynomial::freeze_turns(Position& x) const {
  if (turns_.empty()) return;
  for (std::size_t p = 1; p < coordinates_.size(); ++p)
    if (turns_[p]) x[p] = model_.info().param(coordinates_[p].name)->value[0];
}

ParamValues AlbedoPolynomial::values_at(const ParamValues& combination, const Position& x) const {
  ParamValues v = combination;
  for (std::size_t i = 1; i < coordinates_.size(); ++i) v[coordinates_[i].name] = x[i];
  return v;
}

std::string AlbedoPolynomial::label(const ParamValues& v) const {
  return fmt::format("{} {}", model_.info().name, format_values(model_.info(), complete(model_.info(), v)));
}

Position AlbedoPolynomial::random_position(std::mt19937_64& random) const {
  std::uniform_real_distribution<double> uniform;
  Position x;
  for (const Coordinate& c : coordinates_) x.push_back(c.at(uniform(random)));
  return x;
}

Coefficients AlbedoPolynomial::coefficients(const ParamValues& combination, const Position& x,
                                            std::optional<double> phi, std::size_t samples, std::uint64_t seed,
                                            bool share_channels) const {
  ParamValues values = values_at(combination, x);
  for (const std::string& c : colors_) values[c] = 0.5;
  const auto guide = model_.make_double(values);
  const std::size_t nodes = monomials(), channels = share_channels ? 3 : 1;
  std::vector<std::unique_ptr<Brdf<double>>> models;
  std::vector<const Brdf<double>*> pointers;
  for (std::size_t first = 0; first < nodes; first += channels) {
    for (std::size_t c = 0; c < colors_.size(); ++c) {
      std::array<double, 3> color;
      for (std::size_t i = 0; i < 3; ++i)
        color[i] = double(power(std::min(first + i % channels, nodes - 1), c)) / degrees_[c];
      values[colors_[c]] = color;
    }
    models.push_back(model_.make_double(values));
    pointers.push_back(models.back().get());
  }
  const std::string name = label(values_at(combination, x)) + " (colours 0, 0.5 or 1)";
  if (!depends_on_azimuth_ && !phi) phi = 0;
  const MeanAlbedo mean = mean_albedos(*guide, pointers, x[0], phi, name, int(samples), seed);
  Coefficients out{mean.scattered, mean.mirror, mean.error * double(nodes)};
  if (share_channels)
    for (std::vector<Rgb<double>>* v : {&out.scattered, &out.mirror}) {
      const std::vector<Rgb<double>> shared = std::exchange(*v, std::vector<Rgb<double>>(nodes));
      for (std::size_t k = 0; k < nodes; ++k) {
        const Rgb<double>& c = shared[k / 3];
        (*v)[k] = Rgb<double>(k % 3 == 0 ? c.r : k % 3 == 1 ? c.g : c.b);
      }
    }
  // Converts values at the colours 0, 1 or 0, 1/2, 1 to coefficients of the monomials.
  for (std::size_t c = 0; c < colors_.size(); ++c)
    for (std::size_t k = 0; k < nodes; ++k) {
      if (power(k, c) != 0) continue;
      for (std::vector<Rgb<double>>* v : {&out.scattered, &out.mirror}) {
        const Rgb<double> f0 = (*v)[k], f1 = (*v)[k + stride(c)];
        if (degrees_[c] == 1) {
          (*v)[k + stride(c)] = f1 - f0;
        } else {
          const Rgb<double> f2 = (*v)[k + 2 * stride(c)];
          (*v)[k + stride(c)] = f1 * 4. - f2 - f0 * 3.;
          (*v)[k + 2 * stride(c)] = (f2 + f0 - f1 * 2.) * 2.;
        }
      }
    }
  return out;
}

std::size_t AlbedoPolynomial::stride(std::size_t c) const {
  std::size_t n = 1;
  for (std::size_t i = 0; i < c; ++i) n *= std::size_t(degrees_[i] + 1);
  return n;
}

std::vector<std::string> AlbedoPolynomial::color_names(std::size_t monomial) const {
  std::vector<std::string> names;
  for (std::size_t c = 0; c < colors_.size(); ++c)
    for (int k = 0; k < power(monomial, c); ++k) names.push_back(colors_[c]);
  return names;
}

std::size_t AlbedoPolynomial::monomial_of(const std::vector<std::string>& names) const {
  std::size_t monomial = 0;
  for (std::size_t c = 0; c < colors_.size(); ++c)
    monomial += stride(c) * std::size_t(std::count(names.begin(), names.end(), colors_[c]));
  return monomial;
}

Rgb<double> AlbedoPolynomial::combine(const Coefficients& c, const std::vector<double>& colors) const {
  Rgb<double> sum(0);
  for (std::size_t k = 0; k < c.scattered.size(); ++k) {
    Rgb<double> product(1);
    for (std::size_t i = 0; i < colors_.size(); ++i)
      for (int j = 0; j < power(k, i); ++j)
        product = product * Rgb<double>(colors[3 * i], colors[3 * i + 1], colors[3 * i + 2]);
    sum += product * (c.scattered[k] + c.mirror[k]);
  }
  return sum;
}

/// A colour enters squared if its half does not give the mean of the values at 0 and 1. Dependence that is not
/// polynomial is found when the table is verified. A quotient with a linear integral leaves only noise.
void AlbedoPolynomial::study_degrees(const std::vector<ParamValues>& combinations) {
  degrees_.assign(colors_.size(), 1);
  std::mt19937_64 random(5);
  for (const ParamValues& combination : combinations)
    for (int i = 0; i < 2; ++i) {
      const Position x = random_position(random);
      ParamValues values = values_at(combination, x);
      for (const std::string& name : colors_) values[name] = 0.5;
      const auto guide = model_.make_double(values);
      for (std::size_t c = 0; c < colors_.size(); ++c) {
        std::vector<std::unique_ptr<Brdf<double>>> models;
        std::vector<const Brdf<double>*> pointers;
        for (const double level : {0., 0.5, 1.}) {
          ParamValues v = values;
          v[colors_[c]] = level;
          models.push_back(model_.make_double(v));
          pointers.push_back(models.back().get());
        }
        const MeanAlbedo m = mean_albedos(*guide, pointers, x[0], 0, label(values), int(kTableSettings.grid_samples));
        // All three values use the same samples, so a deviation from a straight line is not noise, except where the
        // model divides by tables.
        const double noise = table_error(model_.info(), values) > 0 ? kTableSettings.same + 7 * m.error : 0;
        for (const std::vector<Rgb<double>>& v : {m.scattered, m.mirror})
          if (max_abs(v[0] + v[2] - v[1] * 2.) > noise + 1e-9 * max_abs(v[0] + v[2])) degrees_[c] = 2;
      }
    }
}

/// Tests whether channels are independent of each other and alike. If so, sharing one coefficient gives identical
/// numbers, to the last bit. Verifying the table compares the resulting polynomial with the model at random colours
/// that differ in every channel.
void AlbedoPolynomial::study_channels(const std::vector<ParamValues>& combinations) {
  if (monomials() == 1) return;
  std::mt19937_64 random(29);
  for (const ParamValues& combination : combinations)
    for (int i = 0; i < 4; ++i) {
      const Position x = random_position(random);
      const double phi = 2 * kPi * double(i) / 4 + 0.3;
      const Coefficients apart = coefficients(combination, x, phi, kTableSettings.grid_samples, 0, false),
                         shared = coefficients(combination, x, phi, kTableSettings.grid_samples, 0, true);
      if (distance(apart, shared) != 0 || apart.error != shared.error) return;
    }
  share_channels_ = true;
}

/// Finds out whether the albedo depends on the azimuth, and which parameters only rotate it.
void AlbedoPolynomial::study_azimuth(const std::vector<ParamValues>& combinations) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> angle(0, 2 * kPi);
  struct Case {
    ParamValues combination;
    Position x;
    double phi, turn;
  };
  std::vector<Case> cases;
  for (const ParamValues& c : combinations)
    for (int i = 0; i < 6; ++i) {
      const Position x = random_position(random);
      const double phi = angle(random);
      cases.push_back({c, x, phi, 0.1 + angle(random) / 8});
    }
  std::vector<Coefficients> base(cases.size());
  depends_on_azimuth_ = true;
  for_all(cases.size(), [&](std::size_t i) { base[i] = coefficients(cases[i].combination, cases[i].x, cases[i].phi); });
  const auto all_equal = [&](const std::function<Coefficients(const Case&)>& variant) {
    std::vector<char> same(cases.size());
    for_all(cases.size(), [&](std::size_t i) { same[i] = !differ(base[i], variant(cases[i])); });
    return std::all_of(same.begin(), same.end(), [](char s) { return s; });
  };
  if (all_equal([&](const Case& c) { return coefficients(c.combination, c.x, c.phi + c.turn); })) {
    depends_on_azimuth_ = false;
    return;
  }
  turns_.assign(coordinates_.size(), false);
  for (std::size_t p = 1; p < coordinates_.size(); ++p) {
    if (coordinates_[p].range.high - coordinates_[p].range.low < 1) continue;
    // The same samples in the rotated frame: the values are equal up to rounding if the parameter only rotates the
    // lobe.
    turns_[p] = all_equal([&](const Case& c) {
      Position x = c.x;
      const double sign = x[p] + c.turn <= coordinates_[p].range.high ? 1 : -1;
      x[p] += sign * c.turn;
      return coefficients(c.combination, x, c.phi + sign * c.turn);
    });
  }
}

}  // namespace brdfc::measure
