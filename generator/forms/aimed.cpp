// SPDX-License-Identifier: GPL-3.0-or-later
// The aimed form (aimed.h): closures aimed at lamps that carry the model there, over a base, and one drawn direction
// for the rest.
#include "forms/aimed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "closures/closure_pool.h"
#include "fit/roles.h"
#include "forms/aimed_steps.h"
#include "forms/error.h"
#include "forms/made_of_fit.h"
#include "forms/osl_form.h"
#include "measure/probes.h"
#include "model/horizon.h"
#include "print/osl_text.h"

namespace brdfc::forms {
namespace {

using print::block;
using print::indented;
using print::number;

/// The statements of the form that depend on the model, for one combination of choices.
struct AimedRecording {
  Recording base;   ///< assigns what its closures take, as an exact form's
  Recording draw;   ///< reads u_0, u_1, u_2; assigns drawn_x, drawn_y, drawn_z
  Recording value;  ///< reads wi_x, wi_y, wi_z and the base's closures; assigns excess and drawn_density
};

AimedRecording record_aimed(const Model& model, const ParamValues& fixed, int indent, AimedBase from,
                            const Cosines& views) {
  Recorder recorder;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  const Vec3<Expr> wo = recorded_wo(model, *brdf);
  const auto turned = [&](const Vec3<Expr>& w) { return turned_to_side(model, *brdf, w); };
  AimedRecording out;
  std::optional<fit::Fit> fit;
  if (from == AimedBase::Fitted) fit = fit::fit_of(model, fixed, views);
  // None for what lies on both sides of the surface.
  const ClosureSum<Expr> base = fit                                ? recorded_fit(model, *fit, fixed, wo)
                                : measure::two_sided(model, *brdf) ? ClosureSum<Expr>()
                                                                   : brdf->base(wo);
  {
    Program program;
    const auto closures = output_closures(base, program, fit ? division_of(*fit) : Division::Done);
    out.base = recording_of(model, program, indent, closures);
  }
  const ClosureSum<Expr> given = input_closures(base);
  {
    Program program;
    program.output("drawn", turned(draw(*brdf, given, wo, recorded_u())));
    out.draw = recording_of(model, program, indent);
  }
  {
    Program program;
    const Vec3<Expr> wi = input3("wi");
    const Excess<Expr> e = excess(*brdf, given, turned(wi), wo);
    program.output("excess", e.value);
    program.output("drawn_density", e.density);
    out.value = recording_of(model, program, indent);
  }
  return out;
}

/// Lamps and rest of an aimed form: one evaluation of the model, in a loop over the lamps and the drawn direction.
class AimedText {
 public:
  /// `through`: whether the model may scatter through the surface.
  AimedText(const ModelInfo& info, const ParamValues& fixed, int lamps, bool through)
      : draw_(info, fixed), value_(info, fixed), lamps_(lamps), through_(through) {}

  void add(const Choices& choices, const AimedRecording& r, SharedArrays& arrays) {
    draw_.add(choices, arrays.without_shared(r.draw));
    value_.add(choices, arrays.without_shared(r.value));
    operations_ = std::max(operations_, r.draw.operations + r.value.operations);
  }

  int operations() const {
    const AimedSteps& steps = aimed_steps(0);
    if (lamps_ == 0) return operations_ + steps.alone.operations;
    int all = operations_ + steps.rest.operations;
    // Without those of cones and of horizons, which few lamps are cut off by.
    for (const Recording* r : {&steps.above, &steps.room, &steps.aim, &steps.low, &steps.less, &steps.send, &steps.toss,
                               &steps.under, &steps.meet})
      all += r->operations;
    return all;
  }

  std::string print() const {
    const AimedSteps& steps = aimed_steps(0);
    std::string out =
        std::string(kDraws) + "    float drawn_x, drawn_y, drawn_z;\n    color rest_colour;\n    float rest_weight;\n";
    if (lamps_ == 0)
      return out + block(draw_.print(0), 1) +
             "    color excess;\n    float drawn_density, wi_x = drawn_x, wi_y = drawn_y, wi_z = drawn_z;\n" +
             block(value_.print(0), 1) + block(steps.alone.statements, 1);
    for (const char* what : {"Place", "Turn", "Scale", "Shape"}) out += slots_array(what);
    out += fmt::format(
        "    vector lamp_centre[{0}], lamp_across[{0}], lamp_along[{0}], lobe_towards[{0}], lobe_half[{0}];\n"
        "    float lamp_disk[{0}], lamp_solid_angle[{0}];\n"
        "    float lobe_weight[{0}], lobe_exponent[{0}], lobe_radius[{0}], lobe_end[{0}], lobe_extent[{0}];\n"
        "    color lobe_value[{0}], lobe_colour[{0}], covered = 0.0, covered_before = 0.0;\n"
        "    float ray_x, ray_y, ray_z, lamp_met = 0.0, density_under = 0.0;\n    int lamps = 0, lobes = 0;\n"
        "    for (int lamp = 0; lamp < {0}; lamp++)\n"
        "        if (lamp_shape[lamp][0] > 0.0)\n            lamps = lamp + 1;\n",
        lamps_);
    out +=
        "    vector horizon = brdfc_local(N, frame_t, frame_b, frame_n);\n"
        "    // The lamps, and at last the direction that was drawn.\n"
        "    for (int lamp = 0; lamp <= lamps; lamp++) {\n"
        "        float wi_x, wi_y, wi_z, lobe_height, lamp_emphasis;\n"
        "        if (lamp < lamps) {\n"
        "            vector centre_here, across_here, along_here, beam_here;\n"
        "            float disk_here, beam_edge, beam_blend, lobe_room = 1.0;\n"
        "            if (brdfc_lamp(lamp_place[lamp], lamp_turn[lamp], lamp_scale[lamp], lamp_shape[lamp], "
        "centre_here, across_here, along_here, disk_here, beam_here, beam_edge, beam_blend) == 0)\n"
        "                continue;\n"
        "            lamp_centre[lobes] = brdfc_local(centre_here, frame_t, frame_b, frame_n);\n"
        "            lamp_across[lobes] = brdfc_local(across_here, frame_t, frame_b, frame_n);\n"
        "            lamp_along[lobes] = brdfc_local(along_here, frame_t, frame_b, frame_n);\n"
        "            lamp_disk[lobes] = disk_here;\n";
    out +=
        "            vector shining_centre = lamp_centre[lobes], shining_across = lamp_across[lobes];\n"
        "            vector shining_along = lamp_along[lobes];\n            float shining_disk = disk_here;\n"
        "            if (beam_edge > 0.0) {\n"
        "                vector beam = brdfc_local(beam_here, frame_t, frame_b, frame_n);\n"
        "                vector lit_centre, lit_across, lit_along;\n                float lit_disk;\n";
    out += indented(steps.beam.statements, 4);
    for (const char* what : {"centre", "across", "along", "disk"})
      out += fmt::format("                lamp_{0}[lobes] = lit_{0};\n", what);
    out += "            }\n";
    // Bump Map Correction bends the normals of lobes towards what is lower, and from Blender 5.0 on Cycles evaluates no
    // lobe towards what is below the interpolated normal.
    out += fmt::format(
        "            vector to_centre = normalize(lamp_centre[lobes]);\n"
        "            to_centre = frame_t * to_centre[0] + frame_b * to_centre[1] + frame_n * to_centre[2];\n"
        "            if (dot(N, to_centre) <= 0.0 || brdfc_is_below(to_centre, {}))\n                continue;\n",
        number(kMirrorRise));
    if (!through_)
      out += "            float lamp_above;\n" + indented(steps.above.statements, 3) +
             "            if (lamp_above <= 0.0)\n                continue;\n";
    out +=
        "            // Numbers of its own: what a lobe gives at another's lamp must not go with where that is met.\n"
        "            vector v_all = brdfc_random(1 + lamp, path_length);\n"
        "            float v_1 = v_all[0], v_2 = v_all[1];\n";
    out += earlier_lobes("", steps.room.statements);
    out += "            float to_lamp_x, to_lamp_y, to_lamp_z, to_half_x, to_half_y, to_half_z;\n";
    out += indented(steps.aim.statements, 3);
    out +=
        "            if (lamp_emphasis == 0.0)\n                continue;\n"
        "            lobe_towards[lobes] = vector(to_lamp_x, to_lamp_y, to_lamp_z);\n"
        "            lobe_half[lobes] = vector(to_half_x, to_half_y, to_half_z);\n"
        "            float lamp_low;\n            {\n";
    out += indented(steps.low.statements, 4) +
           "            }\n            if (lamp_low < 0.0 && brdfc_cuts_off() != 0) {\n" +
           indented(steps.cut.statements, 4) +
           "                if (lamp_emphasis == 0.0)\n                    continue;\n            }\n";
    out +=
        "            // Drawn directions do not meet it, or are not to: see brdfc_lamp().\n"
        "            if (lamp_shape[lamp][1] < 0.0)\n                lamp_solid_angle[lobes] = 1e-20;\n"
        "        } else {\n"
        "            float tossed;\n";
    out += indented(steps.toss.statements, 3);
    out += "            if (tossed < 0.0) {\n" + indented(draw_.print(0), 4) +
           "            } else {\n                int chosen = int(tossed);\n" + indented(steps.under.statements, 4) +
           "            }\n"
           "            ray_x = drawn_x;\n            ray_y = drawn_y;\n            ray_z = drawn_z;\n";
    // Neither lamp nor seam reaches out from under its lobe.
    out += earlier_lobes("if (dot(lobe_towards[earlier], vector(drawn_x, drawn_y, drawn_z)) > lobe_end[earlier]) ",
                         steps.meet.statements);
    out +=
        "            wi_x = drawn_x;\n            wi_y = drawn_y;\n            wi_z = drawn_z;\n"
        "        }\n"
        "        color excess;\n        float drawn_density;\n";
    out += indented(value_.print(0), 2);
    out += "        if (lamp < lamps) {\n" +
           earlier_lobes("if (dot(lobe_towards[earlier], vector(wi_x, wi_y, wi_z)) > lobe_end[earlier]) ",
                         steps.less.statements) +
           indented(steps.send.statements, 3) + "            lobes++;\n        } else {\n" +
           indented(steps.rest.statements, 3) + "        }\n    }\n";
    // Each joins the sum from the left: Cycles walks it without a stack. The weight is a colour: see kPoolNode.
    std::string ramp;
    for (const double c : aimed_ramp()) ramp += (ramp.empty() ? "" : ", ") + number(c);
    out += fmt::format(
        "    closure color aimed = 0;\n"
        "    for (int lamp = 0; lamp < lobes; lamp++)\n"
        "        if (lobe_weight[lamp] > 0.0) {{\n"
        "            float lobe_level[{0}] = {{{1}}};\n"
        "            color lobe_colours[{0}];\n"
        "            for (int entry = 0; entry < {0}; entry++)\n                lobe_colours[entry] = "
        "lobe_level[entry] * lobe_colour[lamp];\n"
        "            vector half_way = lobe_half[lamp];\n"
        "            half_way = frame_t * half_way[0] + frame_b * half_way[1] + frame_n * half_way[2];\n"
        "            color lobe_followed = lobe_weight[lamp];\n"
        "            aimed = lobe_followed * phong_ramp(half_way, lobe_exponent[lamp], lobe_colours) + aimed;\n"
        "        }}\n",
        kRampSize, ramp);
    return out;
  }

 private:
  std::string slots_array(const std::string& what) const {
    std::string list;
    for (int i = 1; i <= lamps_; ++i) list += fmt::format("{}Lamp{}{}", i > 1 ? ", " : "", what, i);
    std::string name = what;
    name[0] = char(std::tolower(name[0]));
    return fmt::format("    vector lamp_{}[{}] = {{{}}};\n", name, lamps_, list);
  }

  /// Done with every lobe so far, in the loop over the lamps.
  static std::string earlier_lobes(const char* condition, const std::string& statements) {
    const std::string loop = "            for (int earlier = 0; earlier < lobes; earlier++)";
    if (!*condition) return loop + " {\n" + indented(statements, 4) + "            }\n";
    return fmt::format("{}\n                {}{{\n", loop, condition) + indented(statements, 5) + "                }\n";
  }

  ChoiceSwitch draw_, value_;
  int lamps_, operations_ = 0;
  bool through_;
};

class Aimed final : public OslForm {
 public:
  Aimed() : OslForm("aimed") {}

  /// An exact form for all choices leaves nothing to aim.
  bool in_whole_pack(const Model& model) const override {
    return model.has_scatter() && (!model.has_exact() || !form("exact")->values(model, {}).empty());
  }
  bool draws() const override { return true; }
  bool aims() const override { return true; }
  std::string under_sizeless_lamps(int lamps, int slots) const override;

  /// What it aims is the model's own value.
  FormError error(const Model& model, const Setting&) const override { return error_of_samples(model); }
  /// Costs were measured with the base that a model declares.
  bool cost_is_measured(const Setting& setting) const override { return setting.base == AimedBase::Declared; }
  const fit::Fit* fit(const Model& model, const Setting& setting) const override {
    return setting.base == AimedBase::Fitted ? &fit::fit_of(model, setting.fixed) : nullptr;
  }

  std::vector<std::string> warnings(const Model& model, const Shader& shader) const override {
    const bool mirror = model.has_mirror();
    // Path Guiding and the passes know nothing of closures that take light away: pictures get 2 % too bright, the
    // albedo too high by what base and rest cancel. Normals are those of the drawn lobes where no base outweighs them.
    std::vector<std::string> codes = {"path_guiding", "orthographic_far", "albedo_passes"};
    if (shader.leaning) codes.push_back("bump_correction");
    // Of lamps without it aimed closures carry all; the panel says which have none.
    if (mirror) codes.insert(codes.end(), {"multiple_importance", "clamp_mirror"});
    if (shader.closures - shader.lamps - (mirror ? 1 : 0) == 1) codes.push_back("normal_pass");
    if (mirror) codes.push_back("filter_glossy");
    return codes;
  }
  bool highlights(const Model& model, const Shader&) const override { return !model.has_mirror(); }

  std::vector<Recording> recordings(const Model& model, const ParamValues& values,
                                    const Setting& setting) const override {
    const AimedRecording r = record_aimed(model, values, 4, setting.base, setting.views);
    const AimedSteps& s = aimed_steps(4);
    return {r.base, r.draw, r.value, s.beam, s.room, s.aim, s.cut, s.less, s.send, s.rest};
  }

 protected:
  void write_closures(ShaderText&) const override;
};

/// Closures that Cycles would evaluate as others than the rest takes off are left out of the base.
void leave_out_of_base(ShaderText& text, const std::vector<RecordedClosure>& base) {
  for (std::size_t c = 0; c < base.size(); ++c) {
    // About a bent normal: by Bump Map Correction Cycles darkens matte ones, and from Blender 5.0 on it evaluates none
    // towards what is below the interpolated normal.
    std::string out = "frame_n != shading_n";
    if (base[c].turned) {
      // Bump Map Correction would bend it.
      out += fmt::format(
          " || brdfc_is_below(reflect(-I, frame_t * normal_{0}_x + frame_b * normal_{0}_y + frame_n * normal_{0}_z), "
          "{1})",
          c, number(kMirrorRise));
    }
    if (text.model.info().look == Look::Matte && !base[c].turned) continue;
    text.statements += fmt::format("    if ({})\n        weight_{} = 0.0;\n", out, c);
  }
  // But for matte ones about normals of their own, which it darkens anywhere.
  text.shader.leaning = std::any_of(base.begin(), base.end(), [](const RecordedClosure& c) {
    return c.turned && c.kind == ClosureKind::DiffuseRamp;
  });
}

std::string Aimed::under_sizeless_lamps(int lamps, int slots) const {
  if (lamps <= slots) return "as on Blender's own nodes";
  const char* left_out = "as rare bright dots";
  if (slots == 0) return left_out;
  return fmt::format("as on Blender's own nodes while among the {} of up to {} lamps that are aimed at, else {}", slots,
                     lamps, left_out);
}

void Aimed::write_closures(ShaderText& text) const {
  const Model& model = text.model;
  const Setting& setting = text.setting;
  Shader& shader = text.shader;
  ChoiceSwitch by_choice(model.info(), setting.fixed);
  AimedText lamps(model.info(), setting.fixed, setting.max_lamps, model.has_through());
  const auto base = text.record(by_choice, [&](const Choices& choices, const ParamValues& values) {
    const AimedRecording r = record_aimed(model, values, 0, setting.base, setting.views);
    lamps.add(choices, r, text.arrays);
    return r.base;
  });
  text.declare(base);
  shader.facets = false;  // none that is seen by more than the camera
  text.statements += block(by_choice.print(0), 1);
  text.scale(base, setting.base == AimedBase::Fitted ? fit::roles_of(model, setting.fixed).with(fit::Role::Factor)
                                                     : std::set<std::string>());
  // Filter Glossy makes facets rougher behind a rough surface, and without caustics Cycles drops them there: then the
  // rest, which takes off what they were to give, would be wrong. Light that has come so far is noisy anyway.
  for (std::size_t c = 0; c < base.size(); ++c)
    if (has_facets(base[c].kind))
      text.statements += fmt::format("    if (raytype(\"camera\") == 0)\n        weight_{} = 0.0;\n", c);
  leave_out_of_base(text, base);
  text.statements += lamps.print();
  shader.lamps = setting.max_lamps;
  shader.operations += lamps.operations();
  shader.slots += (setting.max_lamps + 1) * slots(ClosureKind::PhongRamp);
  shader.closure_bytes += ray_bytes(model);
  const bool aimed = setting.max_lamps > 0;
  const char* wi = aimed ? "ray_{0}" : "drawn_{0}";
  const auto part = [&](const char* axis) { return fmt::format(fmt::runtime(wi), axis); };
  const std::string ray =
      fmt::format("    vector ray = frame_t * {} + frame_b * {} + frame_n * {};\n", part("x"), part("y"), part("z"));
  shader.lamp_bytes = aimed ? pool_bytes(ClosureKind::PhongRamp) + kPoolNode : 0;
  if (aimed) text.terms.push_back("aimed");
  // As a colour: see kPoolNode.
  if (!model.has_through()) {
    text.statements += "    color rest_followed = rest_weight;\n" + ray + lost_below(model, "ray", "rest_followed");
    std::string of_base;
    for (std::size_t c = 0; c < base.size(); ++c)
      of_base += fmt::format("{}weight_{} != color(0.0)", c > 0 ? " || " : "", c);
    if (!base.empty())
      text.statements +=
          fmt::format("    if ({}) {{\n        rest_followed *= {};\n        rest_colour /= {};\n    }}\n", of_base,
                      number(kRestFollowed), number(kRestFollowed));
  }
  if (model.has_through()) text.statements += ray + lost_below(model, "ray", "rest_weight");
  text.terms.push_back(model.has_through() ? "brdfc_signed_ray_anywhere(rest_weight, rest_colour, ray, I, frame_n)"
                                           : "rest_followed * brdfc_ray_coloured(ray, I, rest_colour)");
  text.turn(base);
}

}  // namespace

const Form& aimed() {
  static const Aimed form;
  return form;
}

}  // namespace brdfc::forms
