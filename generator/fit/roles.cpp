// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/roles.h"

#include <stdexcept>
#include <vector>

#include "fit/view.h"

namespace brdfc::fit {

Roles::Roles(const Model& model, ParamValues given)
    : model_(model),
      given_(std::move(given)),
      proportional_(factors(model, given_)),
      terms_(terms_of(model, given_, proportional_)) {
  std::vector<const ParamInfo*> open;
  for (const ParamInfo& p : model.info().params) {
    Role& role = roles_[p.name];
    role = given_.count(p.name)          ? Role::Constant
           : proportional_.count(p.name) ? Role::Factor
           : terms_.has(p.name)          ? Role::Mixed
                                         : Role::Open;
    if (role == Role::Open) open.push_back(&p);
  }
  if (open.size() == 1 && open.front()->kind == ParamKind::Number) roles_[open.front()->name] = Role::Axis;
}

std::set<std::string> Roles::with(Role wanted) const {
  std::set<std::string> out;
  for (const auto& [name, role] : roles_)
    if (role == wanted) out.insert(name);
  return out;
}

const ParamInfo* Roles::axis() const {
  for (const auto& [name, role] : roles_)
    if (role == Role::Axis) return model_.info().param(name);
  return nullptr;
}

ParamValues Roles::fitted() const {
  ParamValues out = given_;
  for (const auto& [name, role] : roles_) {
    if (role == Role::Open) throw std::logic_error(model_.info().name + ": a fit without " + name);
    if (role == Role::Factor) out[name] = as_value(*model_.info().param(name), Rgb<double>(1.0));
  }
  return out;
}

ParamValues Roles::fitted_at(double number) const {
  ParamValues out = fitted();
  if (const ParamInfo* p = axis()) out[p->name] = number;
  return out;
}

const Roles& roles_of(const Model& model, const ParamValues& given) { return made_once<Roles>(model, given); }

std::optional<std::string> unfit(const Model& model, const ParamValues& given) {
  if (!model.has_scatter()) return "it only reflects and refracts ideally";
  for (const ParamValues& values : places(model, given)) {
    const auto brdf = model.make_double(values);
    if (model.has_transmit() || model.has_medium() || brdf->scatters_through()) return "it lets light through";
    if (!model.info().properties.isotropic && turns(*brdf)) return "it is anisotropic";
  }
  return std::nullopt;
}

Split without_factors(const Model& model, const ParamValues& values) {
  Split out{values, Rgb<double>(1.0)};
  for (const std::string& name : roles_of(model, values).proportional()) {
    ParamValue& value = out.values.at(name);
    out.factor = out.factor * as_rgb(value);
    value = as_value(*model.info().param(name), Rgb<double>(1.0));
  }
  return out;
}

Split along_axis(const Model& model, const ParamValues& values) {
  ParamValues choices = values, out = values;
  for (const ParamInfo& p : model.info().params)
    if (p.kind != ParamKind::Choice) choices.erase(p.name);
  for (const std::string& name : roles_of(model, choices).with(Role::Mixed)) out.erase(name);
  // A parameter may be a factor only for these values of the others.
  for (const std::string& name : roles_of(model, out).proportional())
    if (const auto it = values.find(name); it != values.end()) out.insert(*it);
  return without_factors(model, out);
}

}  // namespace brdfc::fit
