// SPDX-License-Identifier: GPL-3.0-or-later
// The exact form: Cycles closures that equal the model, as the model declares them.
#include <set>

#include "forms/error.h"
#include "forms/osl_form.h"

namespace brdfc::forms {
namespace {

class Exact final : public OslForm {
 public:
  Exact() : OslForm("exact") {}

  bool in_whole_pack(const Model& model) const override { return model.has_exact(); }
  /// Choices, if closures are declared only for some of them.
  ParamValues values(const Model& model, const ParamValues& fixed) const override;

  FormError error(const Model& model, const Setting&) const override {
    return error_of_closures(
        model, values(model, {}), [&](const Brdf<Expr>& brdf) { return closures(model, brdf); },
        "closures equal the model; what is left is rounding");
  }

  std::vector<std::string> warnings(const Model& model, const Shader& shader) const override {
    std::vector<std::string> codes = warnings_of_closures(model, shader);
    // These ramps may have negative entries. The passes ignore what they subtract.
    if (has_ramps(shader)) codes.push_back("albedo_passes");
    return codes;
  }
  bool highlights(const Model& model, const Shader& shader) const override {
    return !model.has_mirror() && has_ramps(shader);
  }

  std::vector<Recording> recordings(const Model& model, const ParamValues& values, const Setting&) const override {
    return {record_closures(model, values, [&](const Brdf<Expr>& brdf) { return closures(model, brdf); })};
  }

 private:
  /// The closures with the weights that the shader has to use.
  static ClosureSum<Expr> closures(const Model& model, const Brdf<Expr>& brdf) {
    std::optional<ClosureSum<Expr>> sum = brdf.exact(recorded_wo(model, brdf));
    if (!sum) input_error("{}: has no exact form", model.info().name);
    if (model.has_medium()) {
      const Rgb<Expr> left = named("medium", medium(brdf, Expr::input("side"), Expr::input("path_length")));
      for (Closure<Expr>& c : *sum) c.weight = c.weight * left;
    }
    // Without dispersion, one refraction serves all channels. The others have weight 0 in every view.
    std::erase_if(*sum, [](const Closure<Expr>& c) {
      std::array<double, 3> weight;
      return c.kind == ClosureKind::Refraction && c.weight.is_constant(&weight) && weight == std::array{0.0, 0.0, 0.0};
    });
    return *sum;
  }
};

ParamValues Exact::values(const Model& model, const ParamValues&) const {
  const ModelInfo& info = model.info();
  std::vector<Choices> known;
  for (const Choices& c : choice_combinations(info))
    if (model.make_double(with_choices(info, c))->exact({0, 0, 1})) known.push_back(c);
  ParamValues only;
  std::size_t k = 0, combinations = 1;
  for (const ParamInfo& p : info.params) {
    if (p.kind != ParamKind::Choice) continue;
    std::set<int> used;
    for (const Choices& c : known) used.insert(c[k]);
    if (used.size() == 1 && p.choices.size() > 1)
      only[p.name] = p.choices[std::size_t(*used.begin())];
    else
      combinations *= p.choices.size();
    ++k;
  }
  if (known.size() != combinations)
    throw std::logic_error(info.name + ": exact() must be decided by choices that each have one value for it");
  return only;
}

}  // namespace

const Form& exact() {
  static const Exact form;
  return form;
}

}  // namespace brdfc::forms
