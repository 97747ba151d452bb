// SPDX-License-Identifier: GPL-3.0-or-later
// Writes the shader of the aimed form (aimed.h): a base, closures aimed at lamps, and one drawn direction for the rest.
#include "forms/aimed.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "fit/roles.h"
#include "forms/aimed_kept.h"
#include "forms/aimed_steps.h"
#include "forms/error.h"
#include "forms/made_of_fit.h"
#include "forms/osl_form.h"
#include "forms/whole.h"
#include "measure/probes.h"
#include "model/horizon.h"
#include "model/under.h"
#include "print/statement.h"

namespace brdfc::forms {
namespace {

using print::append;
using print::assign;
using print::Assign;
using print::Block;
using print::call;
using print::choice;
using print::Comment;
using print::Continue;
using print::declare;
using print::Declare;
using print::declare_all;
using print::element;
using print::If;
using print::Loop;
using print::operation;
using print::Run;
using print::Statement;
using print::Statements;
using print::Value;
using print::Variable;

/// The parts of the form that depend on the model, recorded for one combination of choices.
struct AimedRecording {
  Recording base;   ///< assigns the inputs of the base's closures, as for an exact form
  Recording draw;   ///< reads u_0, u_1, u_2; assigns drawn_x, drawn_y, drawn_z
  Recording value;  ///< reads wi_x, wi_y, wi_z and the base's closures; assigns excess and drawn_density
};

AimedRecording record_aimed(const Model& model, const ParamValues& fixed, AimedBase from, const Cosines& views) {
  Recorder recorder;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  const Vec3<Expr> wo = recorded_wo(model, *brdf);
  const auto turned = [&](const Vec3<Expr>& w) { return turned_to_side(model, *brdf, w); };
  AimedRecording out;
  std::optional<fit::Fit> fit;
  if (from == AimedBase::Fitted) fit = fit::fit_of(model, fixed, views);
  // There is no base for models that scatter on both sides of the surface.
  const ClosureSum<Expr> base = fit                                ? recorded_fit(model, *fit, fixed, wo)
                                : measure::two_sided(model, *brdf) ? ClosureSum<Expr>()
                                                                   : brdf->base(wo);
  {
    Program program;
    const auto closures = output_closures(base, program, fit ? division_of(*fit) : Division::Done);
    out.base = recording_of(model, std::move(program), closures);
  }
  const ClosureSum<Expr> given = input_closures(base);
  {
    Program program;
    program.output("drawn", turned(draw(*brdf, given, wo, recorded_u())));
    out.draw = recording_of(model, std::move(program));
  }
  {
    Program program;
    const Vec3<Expr> wi = input3("wi");
    const Excess<Expr> e = excess(*brdf, given, turned(wi), wo);
    program.output("excess", e.value);
    program.output("drawn_density", e.density);
    out.value = recording_of(model, std::move(program));
  }
  return out;
}

/// name_x, name_y and name_z.
std::vector<std::string> components(const std::string& name) { return {name + "_x", name + "_y", name + "_z"}; }
Value vector_of(const std::string& name) { return call("vector", {name + "_x", name + "_y", name + "_z"}); }
/// A slot of the current lamp.
Value of_lamp(const char* array) { return element(array, "lamp"); }
/// Transforms a direction of the scene into the shader's frame.
Value in_frame(Value direction) { return call("brdfc_local", {std::move(direction), "frame_t", "frame_b", "frame_n"}); }

/// Statements for the lamps and the rest of an aimed form. They are one loop over the lamps with one more iteration for
/// the drawn direction, so that the model is evaluated at a single place in the text.
class AimedLamps {
 public:
  /// `through`: whether the model may scatter through the surface.
  AimedLamps(const ModelInfo& info, const ParamValues& fixed, int lamps, bool through)
      : draw_(info, fixed), value_(info, fixed), lamps_(lamps), through_(through) {}

  void add(const Choices& choices, const AimedRecording& r, SharedArrays& arrays) {
    draw_.add(choices, arrays.run(r.draw));
    value_.add(choices, arrays.run(r.value));
    operations_ = std::max(operations_, r.draw.operations() + r.value.operations());
  }

  int operations() const {
    if (lamps_ == 0) return operations_ + steps_.alone.operations();
    int all = operations_ + steps_.rest.operations();
    // Programs for light cones and horizons are not counted, because few lamps need them.
    for (const Recording* r : {&steps_.above, &steps_.room, &steps_.aim, &steps_.low, &steps_.emphasis, &steps_.less,
                               &steps_.send, &steps_.toss, &steps_.under, &steps_.meet})
      all += r->operations();
    return all;
  }

  Statements statements() const {
    Statements out = declare_draws();
    append(out, {declare_all("float", components("drawn")), declare("color", "rest_colour"),
                 declare("float", "rest_weight")});
    if (lamps_ == 0) {
      append(out, print::scope(draw_.statements()));
      append(out, {declare("color", "excess"), declare_drawn_as_wi(), Block{value_.statements()},
                   Block{{run(steps_.alone)}}});
      return out;
    }
    out.push_back(kinds_of_lamps());
    for (const char* what : {"Place", "Turn", "Scale", "Shape"}) out.push_back(slots_array(what));
    append(out, state());
    out.push_back(declare("vector", "horizon", in_frame("N")));
    out.push_back(Comment{"The lamps, and at last the direction that was drawn."});
    Statements turn = {
        declare_all("vector", {"lamp_centre", "lamp_across", "lamp_along", "lobe_towards", "lobe_half"}),
        declare_all("float", {"wi_x", "wi_y", "wi_z", "lamp_disk", "lamp_solid_angle", "lamp_density", "lamp_rise",
                              "lamp_emphasis", "lobe_height", "lobe_exponent", "lobe_radius", "lobe_end", "lobe_extent",
                              "lobe_rise"}),
        If{is_lamp(), aim(), draw()},
        declare("color", "excess"),
        declare("float", "drawn_density"),
    };
    append(turn, value_.statements());
    turn.push_back(If{is_lamp(), send(), {run(steps_.rest)}});
    out.push_back(Loop{"lamp", "lamps", turn, true});
    return out;
  }

 private:
  static Run run(const Recording& r) { return {r.program, r.taken}; }
  /// True in the iterations for lamps, false in the one for the drawn direction.
  static Value is_lamp() { return operation("lamp", "<", "lamps"); }

  static Statement declare_drawn_as_wi() {
    return Declare{"float", {{"drawn_density"}, {"wi_x", {"drawn_x"}}, {"wi_y", {"drawn_y"}}, {"wi_z", {"drawn_z"}}}};
  }

  /// An array with the values of the lamps' sockets.
  Statement slots_array(const std::string& what) const {
    Variable array{"lamp_" + what, {}, lamps_};
    array.name[5] = char(std::tolower(what[0]));
    for (int i = 1; i <= lamps_; ++i) array.values.push_back(fmt::format("Lamp{}{}", what, i));
    return Declare{"vector", {array}};
  }

  /// What the lamps of the scene need. The sockets are constants, so OSL leaves out what they do not need when it
  /// compiles the shader for a scene.
  Statement kinds_of_lamps() const {
    const auto any = [&](int first, const auto& is) {
      std::vector<Value> slots;
      for (int i = first; i <= lamps_; ++i) slots.push_back(is(Value(fmt::format("LampShape{}", i))));
      return slots.empty() ? Value(0) : print::any_of(slots);
    };
    const auto test = [](const char* function) { return [=](const Value& shape) { return call(function, {shape}); }; };
    return Declare{"int",
                   {{"any_flat", {any(1, test("brdfc_is_flat"))}},
                    {"any_spot", {any(1, test("brdfc_is_spot"))}},
                    {"any_beam", {any(1, test("brdfc_has_beam"))}},
                    // The part of a lamp that its light cone reaches may be a rectangle.
                    {"any_corner", {print::any_of({"any_beam", any(1, test("brdfc_is_rectangle"))})}},
                    {"several", {any(2, [](const Value& shape) { return operation(element(shape, 0), ">", 0.0); })}}}};
  }

  /// Declares the variables for lamps and lobes, and finds the last socket in use.
  Statements state() const {
    Value used(0);
    for (int i = 1; i <= lamps_; ++i)
      used = choice(operation(element(fmt::format("LampShape{}", i), 0), ">", 0.0), i, used);
    return {
        Declare{"matrix", {{kept_array("lamp"), {}, lamps_}, {kept_array("lobe"), {}, lamps_}}},
        Declare{"color", {{"covered", {0.0}}, {"covered_before", {0.0}}}},
        Declare{"float", {{"ray_x"}, {"ray_y"}, {"ray_z"}, {"lamp_met", {0.0}}, {"density_under", {0.0}}}},
        declare("closure color", "aimed", 0),
        Declare{"int", {{"lamps", {used}}, {"lobes", {0}}}},
    };
  }

  /// Aims a lobe at the lamp, or continues with the next lamp.
  Statements aim() const {
    Statements out = {
        declare_all("vector", {"centre_here", "across_here", "along_here", "beam_here"}),
        Declare{"float", {{"disk_here"}, {"beam_edge"}, {"beam_blend"}, {"lobe_room", {1.0}}}},
        declare("vector", "shape_here", of_lamp("lamp_shape")),
        If{operation(call("brdfc_lamp", {of_lamp("lamp_place"), of_lamp("lamp_turn"), of_lamp("lamp_scale"),
                                         "shape_here", "any_flat", "any_spot", "centre_here", "across_here",
                                         "along_here", "disk_here", "beam_here", "beam_edge", "beam_blend"}),
                     "==", 0),
           {Continue{}}},
        assign("lamp_centre", in_frame("centre_here")),
        assign("lamp_across", in_frame("across_here")),
        assign("lamp_along", in_frame("along_here")),
        assign("lamp_disk", "disk_here"),
        declare("vector", "beam", in_frame("beam_here")),
        Declare{"vector",
                {{"full_centre", {"lamp_centre"}}, {"full_across", {"lamp_across"}}, {"full_along", {"lamp_along"}}}},
        declare("float", "full_disk", "disk_here"),
    };
    const Value has_beam = print::all_of({"any_beam", operation("beam_edge", ">", 0.0)});
    Statements lit = {
        declare_all("vector", {"lit_centre", "lit_across", "lit_along"}),
        declare("float", "lit_disk"),
        run(steps_.bounds),
    };
    for (const std::string what : {"centre", "across", "along", "disk"})
      lit.push_back(assign("lamp_" + what, "lit_" + what));
    // Bump Map Correction bends the normals of lobes downwards. From Blender 5.0 on, Cycles evaluates no lobe in
    // directions below the interpolated normal.
    append(out, {
                    If{has_beam, lit},
                    declare("vector", "to_centre", call("normalize", {"lamp_centre"})),
                    assign("to_centre", in_scene_of("to_centre")),
                    If{print::any_of({operation(call("dot", {"N", "to_centre"}), "<=", 0.0),
                                      call("brdfc_is_below", {"to_centre", kMirrorRise})}),
                       {Continue{}}},
                });
    if (!through_)
      append(out,
             {declare("float", "lamp_above"), run(steps_.above), If{operation("lamp_above", "<=", 0.0), {Continue{}}}});
    const Statement none_left = If{operation("lamp_rise", "<=", 0.0), {Continue{}}};
    append(out,
           {
               Comment{"Numbers of its own: what a lobe gives at another's lamp must not go with where that is met."},
               declare("vector", "v_all", call("brdfc_random", {Value(1) + "lamp", "path_length"})),
               Declare{"float",
                       {{"v_1", {element("v_all", 0)}},
                        {"v_2", {element("v_all", 1)}},
                        {"v_3", {element("v_all", 2)}},
                        {"lamp_low"},
                        {"lamp_cut", {0.0}}}},
               If{"several", {earlier_lobes({"towards", "radius"}, {run(steps_.room)})}},
               declare_all("float", {"to_lamp_x", "to_lamp_y", "to_lamp_z", "to_half_x", "to_half_y", "to_half_z"}),
               run(steps_.aim),
               none_left,
               assign("lobe_towards", vector_of("to_lamp")),
               assign("lobe_half", vector_of("to_half")),
               Block{{run(steps_.low)}},
               If{print::all_of({operation("lamp_low", "<", 0.0),
                                 operation(call("brdfc_cuts_off", {"shape_here", "centre_here", "across_here",
                                                                   "along_here", "disk_here"}),
                                           "!=", 0)}),
                  {assign("lamp_cut", 1.0), run(steps_.cut), none_left}},
               If{has_beam, {run(steps_.lit), none_left}},
               Block{{run(steps_.emphasis)}},
               If{operation("lamp_emphasis", "==", 0.0), {Continue{}}},
               Comment{"Drawn directions do not meet it, or are not to: see brdfc_lamp()."},
               If{operation(element("shape_here", 1), "<", 0.0), {assign("lamp_solid_angle", 1e-20)}},
               keep("lamp"),
           });
    return out;
  }

  /// Draws a direction, and sums up what the lamps mean for it.
  Statements draw() const {
    Statements draw_under = {declare("int", "chosen", call("int", {"tossed"}))};
    append(draw_under, load("chosen", "chosen", {"towards", "extent"}));
    draw_under.push_back(run(steps_.under));
    Statements out = {
        declare("float", "tossed"),
        run(steps_.toss),
        If{operation("tossed", "<", 0.0), draw_.statements(), draw_under},
    };
    for (const char* axis : {"_x", "_y", "_z"})
      out.push_back(assign(std::string("ray") + axis, std::string("drawn") + axis));
    // A lamp and its seam always lie within the lamp's lobe.
    out.push_back(under_earlier_lobes(
        "drawn", {"half", "exponent", "extent", "rise", "value", "centre", "across", "along", "disk", "solid_angle"},
        steps_.meet));
    for (const char* axis : {"_x", "_y", "_z"})
      out.push_back(assign(std::string("wi") + axis, std::string("drawn") + axis));
    return out;
  }

  /// Assigns the value of the lobe that was aimed, keeps its numbers, and adds its closure.
  Statements send() const {
    Statements out = {If{"several", {under_earlier_lobes("wi", {"half", "exponent", "rise", "value"}, steps_.less)}},
                      declare("float", "lobe_weight"), declare_all("color", {"lobe_value", "lobe_colour"}),
                      run(steps_.send)};
    append(out, {keep("lobe"), print::Increment{"lobes"}, closure()});
    return out;
  }

  /// A loop over all lobes so far, inside the loop over the lamps, that reads these numbers of each.
  static Statement earlier_lobes(const std::vector<std::string_view>& names, const Statements& body) {
    Statements all = load("earlier", "earlier", names);
    append(all, body);
    return Loop{"earlier", "lobes", std::move(all)};
  }
  /// A loop over the lobes so far that contain a direction.
  static Statement under_earlier_lobes(const std::string& direction, const std::vector<std::string_view>& names,
                                       const Recording& step) {
    Statements inside = load("earlier", "earlier", names);
    inside.push_back(run(step));
    const Value is_under = operation(call("dot", {"earlier_towards", vector_of(direction)}), ">", "earlier_end");
    return earlier_lobes({"towards", "end"}, {If{is_under, inside}});
  }
  /// Transforms a direction of the shader's frame into the scene.
  static Value in_scene_of(const char* v) { return in_scene(element(v, 0), element(v, 1), element(v, 2)); }

  /// The closure of the lobe. It is added at the left of the sum, which Cycles traverses without a stack. The weight is
  /// a colour: OSL stores it with the closure, and a number apart from it (peephole2() in its runtimeoptimize.cpp).
  static Statement closure() {
    Variable colours{"lobe_colours", {}, int(kRampSize)};
    for (const double c : aimed_ramp()) colours.values.push_back(c == 0 ? Value(0.0) : Value(c) * "lobe_colour");
    return If{
        operation("lobe_weight", ">", 0.0),
        {
            Declare{"color", {colours}},
            declare("vector", "half_way", in_scene_of("lobe_half")),
            declare("color", "lobe_followed", "lobe_weight"),
            assign("aimed", Value("lobe_followed") * call("phong_ramp", {"half_way", "lobe_exponent", "lobe_colours"}) +
                                "aimed"),
        }};
  }

  const AimedSteps& steps_ = aimed_steps();
  ChoiceSwitch draw_, value_;
  int lamps_, operations_ = 0;
  bool through_;
};

class Aimed final : public OslForm {
 public:
  Aimed() : OslForm("aimed") {}

  /// Not needed if a preferred form exists for all values of the parameters.
  bool in_whole_pack(const Model& model) const override {
    if (!model.has_scatter()) return false;
    const auto own = std::ranges::find(forms(), static_cast<const Form*>(this));
    return std::none_of(forms().begin(), own, [&](const Form* f) {
      return f->when() == When::Always && f->in_whole_pack(model) && f->values(model, {}).empty();
    });
  }
  bool draws() const override { return true; }
  bool aims() const override { return true; }
  std::string under_sizeless_lamps(int lamps, int slots) const override;

  /// The aimed value is the model's own, so the error is that of the model's samples.
  FormError error(const Model& model, const Setting&) const override { return error_of_samples(model); }
  /// Costs were measured with the declared base.
  bool cost_is_measured(const Setting& setting) const override { return setting.base == AimedBase::Declared; }
  const fit::Fit* fit(const Model& model, const Setting& setting) const override {
    return setting.base == AimedBase::Fitted ? &fit::fit_of(model, setting.fixed) : nullptr;
  }

  std::vector<std::string> warnings(const Model& model, const Shader& shader) const override {
    const bool mirror = model.has_mirror();
    // Path Guiding and the render passes do not support closures that subtract light. Pictures become 2 % too bright,
    // and the albedo pass too high by the light that base and rest cancel. The normal pass shows the normals of the
    // drawn lobes unless a base outweighs them.
    std::vector<std::string> codes = {"path_guiding", "orthographic_far", "albedo_passes"};
    if (shader.leaning) codes.push_back("bump_correction");
    // For lamps without multiple importance sampling, the aimed closures carry all of the light; the panel names such
    // lamps.
    if (mirror) codes.insert(codes.end(), {"multiple_importance", "clamp_mirror"});
    if (shader.closures - shader.lamps - (mirror ? 1 : 0) == 1) codes.push_back("normal_pass");
    if (has_whole(model)) codes.push_back("caustics");
    if (mirror || has_whole(model)) codes.push_back("filter_glossy");
    return codes;
  }
  bool highlights(const Model& model, const Shader&) const override { return !model.has_mirror(); }

  std::vector<Recording> recordings(const Model& model, const ParamValues& values,
                                    const Setting& setting) const override {
    const AimedRecording r = record_aimed(model, values, setting.base, setting.views);
    std::vector<Recording> out = aimed_steps().all();
    out.insert(out.end(), {r.base, r.draw, r.value});
    return out;
  }

 protected:
  void make_closures(ShaderBody&) const override;
};

/// Removes closures from the base where Cycles would evaluate them differently from what the rest subtracts.
void leave_out_of_base(ShaderBody& body, const std::vector<RecordedClosure>& base) {
  for (std::size_t c = 0; c < base.size(); ++c) {
    if (body.model.info().look == Look::Matte && !base[c].turned) continue;
    // True where the normal is bent: with Bump Map Correction, Cycles darkens Diffuse closures, and from Blender 5.0 on
    // it evaluates no closure in directions below the interpolated normal.
    std::vector<Value> out = {operation("frame_n", "!=", "shading_n")};
    // Bump Map Correction would bend this normal.
    if (base[c].turned)
      out.push_back(
          call("brdfc_is_below", {call("reflect", {-Value("I"), in_scene(fmt::format("normal_{}", c))}), kMirrorRise}));
    body.add(If{print::any_of(out), {assign(fmt::format("weight_{}", c), 0.0)}});
  }
  // Except for Diffuse closures with their own normal, which it darkens everywhere.
  body.shader.leaning = std::any_of(base.begin(), base.end(), [](const RecordedClosure& c) {
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

void Aimed::make_closures(ShaderBody& body) const {
  const Model& model = body.model;
  const Setting& setting = body.setting;
  Shader& shader = body.shader;
  ChoiceSwitch by_choice(model.info(), setting.fixed);
  AimedLamps lamps(model.info(), setting.fixed, setting.max_lamps, model.has_through());
  const auto base = body.record(by_choice, [&](const Choices& choices, const ParamValues& values) {
    const AimedRecording r = record_aimed(model, values, setting.base, setting.views);
    lamps.add(choices, r, body.arrays);
    return r.base;
  });
  body.declare(base);
  shader.facets = false;  // only camera rays see them
  body.add(print::scope(by_choice.statements()));
  body.scale(base, setting.base == AimedBase::Fitted ? fit::roles_of(model, setting.fixed).with(fit::Role::Factor)
                                                     : std::set<std::string>());
  const auto weight = [](std::size_t c) { return fmt::format("weight_{}", c); };
  // After a rough surface, Filter Glossy increases the roughness of microfacet closures, and without caustics Cycles
  // drops them. The rest, which subtracts their values, would then be wrong. Such light is noisy anyway, so these
  // closures are kept only for camera rays.
  for (std::size_t c = 0; c < base.size(); ++c)
    if (has_facets(base[c].kind))
      body.add(If{operation(call("raytype", {print::quotation("camera")}), "==", 0), {assign(weight(c), 0.0)}});
  leave_out_of_base(body, base);
  body.add(lamps.statements());
  shader.lamps = setting.max_lamps;
  shader.operations += lamps.operations();
  shader.slots += (setting.max_lamps + 1) * slots(ClosureKind::PhongRamp);
  const bool aimed = setting.max_lamps > 0;
  const Statement ray = declare("vector", "ray", in_scene(aimed ? "ray" : "drawn"));
  if (aimed) body.terms.push_back("aimed");
  if (model.has_through()) {
    body.add(ray);
    body.add(lost_below(model, "ray", "rest_weight"));
    body.terms.push_back(call("brdfc_signed_ray_anywhere", {"rest_weight", "rest_colour", "ray", "I", "frame_n"}));
  } else {
    // As a colour, which takes less memory: see AimedLamps::closure().
    body.add(declare("color", "rest_followed", "rest_weight"));
    body.add(ray);
    body.add(lost_below(model, "ray", "rest_followed"));
    std::vector<Value> of_base;
    for (std::size_t c = 0; c < base.size(); ++c) of_base.push_back(operation(weight(c), "!=", call("color", {0.0})));
    if (!base.empty())
      body.add(If{print::any_of(of_base),
                  {Assign{"rest_followed", kRestFollowed, "*="}, Assign{"rest_colour", kRestFollowed, "/="}}});
    body.terms.push_back(Value("rest_followed") * call("brdfc_ray_coloured", {"ray", "I", "rest_colour"}));
  }
  body.turn(base);
  add_whole(body);
}

}  // namespace

const Form& aimed() {
  static const Aimed form;
  return form;
}

}  // namespace brdfc::forms
