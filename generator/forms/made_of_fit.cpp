// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/made_of_fit.h"

#include <fmt/format.h>

#include <algorithm>

#include "fit/roles.h"

namespace brdfc::forms {

FormError error_of_fit(const std::vector<fit::ViewError>& errors, const std::string& what,
                       const std::optional<fit::FitAxis>& axis) {
  FormError out;
  double sum1 = 0, sum2 = 0;
  fit::ViewError worst;
  for (const fit::ViewError& e : errors) {
    sum1 += e.relative_l1 / double(errors.size());
    sum2 += e.relative_l2 / double(errors.size());
    out.albedo = std::max(out.albedo, e.albedo);
    if (e.relative_l1 > worst.relative_l1) worst = e;
  }
  out.relative_l1 = sum1;
  out.relative_l2 = sum2;
  out.note =
      fmt::format("{}, error at most {:.2g}, seen at a cosine of {:.2g}{}", what, worst.relative_l1, worst.cos_theta_o,
                  axis ? fmt::format(", with {} = {:.3g}", axis->parameter, worst.number) : "");
  return out;
}

ParamValues values_of_fit(const Model& model, const ParamValues& fixed) {
  const ModelInfo& info = model.info();
  const ParamValues defaults = complete(info, {});
  ParamValues known = fixed;
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Choice) known.insert(*defaults.find(p.name));
  for (const std::string& name : fit::roles_of(model, known).with(fit::Role::Open))
    if (name != info.properties.fit_axis) known.insert(*defaults.find(name));
  // A number that scales curves says nothing of the light if the curves are not those of the fit.
  if (!info.properties.albedo_table)
    for (const ParamInfo& p : info.params)
      if (p.kind == ParamKind::Number && p.name != info.properties.fit_axis) known.insert(*defaults.find(p.name));
  for (const auto& [name, value] : fixed) known.erase(name);
  return known;
}

}  // namespace brdfc::forms
