// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/values.h"

#include <stdexcept>

#include "fit/view.h"

namespace brdfc::fit {

std::optional<std::string> unfit(const Model& model, const ParamValues& known) {
  if (!model.has_scatter()) return "it only reflects and refracts ideally";
  for (const ParamValues& values : places(model, known)) {
    const auto brdf = model.make_double(values);
    if (model.has_transmit() || model.has_medium() || brdf->scatters_through()) return "it lets light through";
    if (!model.info().properties.isotropic && turns(*brdf)) return "it is anisotropic";
  }
  return std::nullopt;
}

const ParamInfo* open_number(const Model& model, const ParamValues& values) {
  const Terms terms = terms_of(model, values);
  const ParamInfo* out = nullptr;
  for (const ParamInfo& p : model.info().params) {
    if (values.count(p.name) || terms.has(p.name)) continue;
    if (out || p.kind != ParamKind::Number) throw std::logic_error(model.info().name + ": a fit without " + p.name);
    out = &p;
  }
  return out;
}

ParamValues without_factors(const Model& model, const ParamValues& known) {
  ParamValues values = known;
  for (const std::string& name : factors(model, known)) {
    values.emplace(name, as_value(*model.info().param(name), Rgb<double>(1.0)));
  }
  open_number(model, values);
  return values;
}

std::pair<ParamValues, Rgb<double>> split_factors(const Model& model, ParamValues values) {
  Rgb<double> factor(1.0);
  for (const std::string& name : factors(model, values)) {
    ParamValue& value = values.at(name);
    factor = factor * as_rgb(value);
    value = as_value(*model.info().param(name), Rgb<double>(1.0));
  }
  return {std::move(values), factor};
}

std::pair<ParamValues, Rgb<double>> split_along_axis(const Model& model, const ParamValues& values) {
  ParamValues unknown = values, out = values;
  for (const ParamInfo& p : model.info().params)
    if (p.kind != ParamKind::Choice) unknown.erase(p.name);
  for (const std::string& name : terms_of(model, unknown).parameters) out.erase(name);
  // What is a factor only here, where others are known.
  for (const std::string& name : factors(model, out))
    if (const auto it = values.find(name); it != values.end()) out.insert(*it);
  return split_factors(model, std::move(out));
}

ParamValues along_axis(const Model& model, const ParamValues& values) { return split_along_axis(model, values).first; }

ParamValues with_number(const Model& model, const ParamValues& values, double number) {
  ParamValues out = values;
  if (const ParamInfo* p = open_number(model, values)) out[p->name] = number;
  return out;
}

}  // namespace brdfc::fit
