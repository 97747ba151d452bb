// SPDX-License-Identifier: GPL-3.0-or-later
// The sampled form: the shader draws a direction from the model itself, one narrow lobe per sample.
#include "closures/closure_pool.h"
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
    // A clamp or a lamp of no size meets the lobe differently from Blender's own closures, and its normal is not the
    // surface's.
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
    return {recording_of(model, program, 4)};
  }

 protected:
  void write_closures(ShaderText& text) const override {
    ChoiceSwitch by_choice(text.model.info(), text.setting.fixed);
    text.record(by_choice,
                [&](const Choices&, const ParamValues& v) { return recordings(text.model, v, text.setting)[0]; });
    text.statements += std::string(kDraws) + "    float wi_x, wi_y, wi_z;\n    color weight;\n" + by_choice.print(4) +
                       "    vector wi = frame_t * wi_x + frame_b * wi_y + frame_n * wi_z;\n" +
                       lost_below(text.model, "wi", "weight");
    text.terms.push_back(text.model.has_through() ? "brdfc_ray_anywhere(weight, wi, I, frame_n)"
                                                  : "weight * brdfc_ray(wi, I)");
    text.shader.slots = slots(ClosureKind::PhongRamp);
    text.shader.closure_bytes = ray_bytes(text.model);
  }
};

}  // namespace

const Form& sampled() {
  static const Sampled form;
  return form;
}

}  // namespace brdfc::forms
