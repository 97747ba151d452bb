// SPDX-License-Identifier: GPL-3.0-or-later
// The exact form: closures of Cycles that equal the model, as it declares them.
#include <set>

#include "forms/osl_form.h"
#include "forms/rounding.h"

namespace brdfc::forms {
namespace {

class Exact final : public OslForm {
 public:
  Exact() : OslForm("exact") {}

  bool in_whole_pack(const Model& model) const override { return model.has_exact(); }
  /// Choices, where closures are known for some alone.
  ParamValues values(const Model& model, const ParamValues& fixed) const override;

  FormError error(const Model& model, const Setting&) const override {
    return rounding_of_closures(model, values(model, {}));
  }

  std::vector<std::string> warnings(const Model& model, const Shader& shader) const override {
    const bool mirror = model.has_mirror();
    std::vector<std::string> codes = {"bump_correction"};
    if (mirror) codes.insert(codes.end(), {"multiple_importance", "clamp_mirror"});
    if (shader.facets) codes.push_back("caustics");
    if (mirror || shader.facets) codes.push_back("filter_glossy");
    // Ramps here are signed: what they take away the passes do not see.
    if (has_ramps(shader)) codes.push_back("albedo_passes");
    return codes;
  }
  bool highlights(const Model& model, const Shader& shader) const override {
    return !model.has_mirror() && has_ramps(shader);
  }

  std::vector<Recording> recordings(const Model& model, const ParamValues& values, const Setting&) const override {
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> brdf = model.record(values);
    Program program;
    const auto sum = recorded_exact(model, *brdf);
    if (!sum) input_error("{}: has no exact representation", model.info().name);
    const std::vector<RecordedClosure> closures = output_closures(*sum, program);
    return {recording_of(model, program, 4, closures)};
  }

 protected:
  void write_closures(ShaderText& text) const override {
    ChoiceSwitch by_choice(text.model.info(), text.setting.fixed);
    const auto closures = text.record(
        by_choice, [&](const Choices&, const ParamValues& v) { return recordings(text.model, v, text.setting)[0]; });
    text.declare(closures);
    text.statements += by_choice.print(4);
    text.turn(closures);
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
