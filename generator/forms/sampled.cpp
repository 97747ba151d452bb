// SPDX-License-Identifier: GPL-3.0-or-later
// The sampled form: the shader draws one direction from the model per sample, and emits it as a narrow lobe.
#include "forms/error.h"
#include "forms/osl_form.h"

namespace brdfc::forms {
namespace {

class Sampled final : public OslForm {
 public:
  Sampled() : OslForm("sampled") {}

  bool in_whole_pack(const Model& model) const override { return model.has_scatter(); }
  bool draws() const override { return true; }
  std::string under_sizeless_lamps(int, int) const override { return "as rare bright dots"; }

  FormError error(const Model& model, const Setting&) const override { return error_of_samples(model); }

  std::vector<std::string> warnings(const Model& model, const Shader&) const override {
    // Clamping and lamps without size affect the lobe differently from Blender's own closures, and the lobe's normal is
    // not the normal of the surface.
    std::vector<std::string> codes = {"multiple_importance", "clamp_indirect",   "clamp_direct",
                                      "zero_size_lights",    "orthographic_far", "normal_pass"};
    if (model.has_mirror()) codes.insert(codes.end(), {"filter_glossy", "albedo_passes_mirror"});
    return codes;
  }

  std::vector<Recording> recordings(const Model& model, const ParamValues& values, const Setting&) const override {
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> brdf = model.record(values);
    Program program;
    output_sampled(model, *brdf, program);
    return {recording_of(model, std::move(program))};
  }

 protected:
  void make_closures(ShaderBody& body) const override {
    ChoiceSwitch by_choice(body.model.info(), body.setting.fixed);
    body.record(by_choice,
                [&](const Choices&, const ParamValues& v) { return recordings(body.model, v, body.setting)[0]; });
    body.add(declare_draws());
    body.add(print::declare_all("float", {"wi_x", "wi_y", "wi_z"}));
    body.add(print::declare("color", "weight"));
    body.add(by_choice.statements());
    body.add(print::declare("vector", "wi", in_scene("wi")));
    body.add(lost_below(body.model, "wi", "weight"));
    body.terms.push_back(body.model.has_through() ? print::call("brdfc_ray_anywhere", {"weight", "wi", "I", "frame_n"})
                                                  : print::Value("weight") * print::call("brdfc_ray", {"wi", "I"}));
    body.shader.slots = slots(ClosureKind::PhongRamp);
  }
};

}  // namespace

const Form& sampled() {
  static const Sampled form;
  return form;
}

}  // namespace brdfc::forms
