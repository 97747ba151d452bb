// SPDX-License-Identifier: GPL-3.0-or-later
// The fitted form: closures that approximate the model for one set of parameters, or along one parameter (fit/fit.h).
#include "fit/roles.h"
#include "forms/made_of_fit.h"
#include "forms/osl_form.h"

namespace brdfc::forms {
namespace {

class Fitted final : public OslForm {
 public:
  Fitted() : OslForm("fitted") {}

  When when() const override { return When::WithinBudget; }
  bool in_whole_pack(const Model& model) const override {
    return model.has_scatter() && !model.info().properties.fit_axis.empty();
  }
  bool made_of_fit() const override { return true; }
  bool gives_base() const override { return true; }
  bool serves(const Model&, fit::Role role) const override { return role != fit::Role::Open; }
  ParamValues values(const Model& model, const ParamValues& fixed) const override {
    return values_of_fit(model, fixed);
  }
  std::optional<std::string> why_not(const Model& model, const ParamValues& fixed) const override {
    return fit::unfit(model, fixed);
  }

  std::string under_sizeless_lamps(int, int) const override {
    return "as on Blender's own nodes, on drawn directions as rare bright dots";
  }
  FormError error(const Model& model, const Setting& setting) const override {
    const fit::Fit fit = fit::fit_of(model, setting.fixed, setting.views);
    return error_of_fit(fit.errors(), "closures fitted to the model", fit.axis());
  }
  std::optional<double> off_by(const Model& model, const Setting& setting,
                               const std::optional<double>& axis) const override {
    return fit::fit_of(model, setting.fixed, setting.views).mean_l1(axis);
  }
  const fit::Fit* fit(const Model& model, const Setting& setting) const override {
    return &fit::fit_of(model, setting.fixed);
  }

  std::vector<std::string> warnings(const Model& model, const Shader& shader) const override {
    return warnings_of_closures(model, shader);
  }
  bool highlights(const Model& model, const Shader& shader) const override {
    return !model.has_mirror() && has_ramps(shader);
  }

  /// They read the axis and the mixed parameters, but not the factors.
  std::vector<Recording> recordings(const Model& model, const ParamValues& values,
                                    const Setting& setting) const override {
    const fit::Fit fit = fit::fit_of(model, values, setting.views);
    const auto closures = [&](const Brdf<Expr>& brdf) {
      const Vec3<Expr> wo = recorded_wo(model, brdf);
      ClosureSum<Expr> sum = recorded_fit(model, fit, values, wo);
      if (model.has_mirror()) sum.emplace_back(ClosureKind::Reflection, brdf.mirror(wo));
      return sum;
    };
    return {record_closures(model, values, closures, division_of(fit))};
  }

 protected:
  double lowest_view() const override { return fit::kLowestView; }
};

}  // namespace

const Form& fitted() {
  static const Fitted form;
  return form;
}

}  // namespace brdfc::forms
