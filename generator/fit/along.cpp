// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/along.h"

#include <algorithm>

#include "fit/fit_tables.h"
#include "fit/solution.h"

namespace brdfc::fit {

measure::BoundModel Along::bound(double place, const ParamValues& mixed) const {
  ParamValues values = values_;
  if (axis_) values[axis_->parameter] = axis_->at(place);
  for (const auto& [name, value] : mixed) values[name] = value;
  return measure::bind_model(model_, values);
}

ParamValues Along::mixed(double value) const {
  ParamValues out;
  for (const std::string& name : terms_.parameters)
    out[name] = as_value(*model_.info().param(name), Rgb<double>(value));
  return out;
}

Along::At::At(const Along& along, double place, double some) : some_(along.bound(place, along.mixed(some))) {
  if (along.terms_.parameters.empty()) return;
  for (const Terms::Term& term : along.terms_.terms) terms_.push_back({along.bound(place, term.values), term.scale});
}

View Along::At::view(const Vec3<double>& wo, int points, const Moments* lobe) const {
  View v = lobe ? view_of(some_, wo, points, *lobe) : view_of(some_, wo, points);
  if (terms_.empty()) return v;
  v.f.resize(v.f.rows(), Eigen::Index(3 * terms_.size()));
  for (std::size_t t = 0; t < terms_.size(); ++t)
    v.f.middleCols(Eigen::Index(3 * t), 3) = scattering(terms_[t].model, v.points, v.wo) / terms_[t].scale;
  return v;
}

std::vector<ViewError> Along::errors(
    const std::vector<double>& places,
    const std::function<ClosureSum<double>(const Vec3<double>& wo, const Varied<double>&)>& closures) const {
  std::vector<ViewError> out;
  for (const double place : places) {
    const double number = axis_ ? axis_->at(place) : 0;
    std::vector<ViewError> worst;
    for (const ParamValues& mixed : terms_.judged()) {
      Varied<double> varied(number);
      varied.parameters = colours_of(mixed);
      const auto of_mixed =
          view_errors(bound(place, mixed), [&](const Vec3<double>& wo) { return closures(wo, varied); });
      if (worst.empty()) worst = of_mixed;
      for (std::size_t i = 0; i < of_mixed.size(); ++i) worst[i] = worse(worst[i], of_mixed[i]);
    }
    for (ViewError e : worst) {
      e.number = number;
      for (double* x : numbers_of(e)) *x = rounded(*x);
      out.push_back(e);
    }
  }
  return out;
}

std::vector<double> proof_places(const std::vector<double>& places) {
  std::vector<double> out = {places.front()};
  for (std::size_t k = 1; k < places.size(); ++k) out.push_back((places[k - 1] + places[k]) / 2);
  if (places.size() > 1) out.push_back(places.back());
  return out;
}

}  // namespace brdfc::fit
