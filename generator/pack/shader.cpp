// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/shader.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "closures/closure_pool.h"
#include "fit/fit.h"
#include "fit/roles.h"
#include "print/osl_library.h"
#include "print/osl_text.h"
#include "print/osl_words.h"

namespace brdfc::pack {
namespace {

using forms::RepresentationKind;

using print::block;
using print::indented;
using print::number;

std::string parameter(const ParamInfo& p) {
  const std::string meta =
      fmt::format(" [[ string label = {}, string help = {} ]],\n", print::quoted(p.label), print::quoted(p.doc));
  switch (p.kind) {
    case ParamKind::Number:
      return fmt::format("    float {} = {}", p.name, number(p.value[0])) + meta;
    case ParamKind::Color:
      return fmt::format("    color {} = {}", p.name, print::color(p.value)) + meta;
    default:
      return fmt::format("    int {} = {}", p.name, int(p.value[0])) + meta;
  }
}

/// Statements that differ by combination of choices: equal ones are written once.
class ChoiceSwitch {
 public:
  ChoiceSwitch(const ModelInfo& info, const ParamValues& fixed) : info_(info), fixed_(fixed) {}

  void add(const Choices& choices, const std::string& statements) {
    for (auto& [text, combinations] : cases_)
      if (text == statements) {
        combinations.push_back(choices);
        return;
      }
    cases_.push_back({statements, {choices}});
  }

  std::string print(int indent) const {
    if (cases_.size() == 1) return cases_[0].first;
    std::string out;
    for (std::size_t i = 0; i < cases_.size(); ++i) {
      const bool last = i + 1 == cases_.size();
      out += fmt::format("{:{}}{}{{\n", "", indent,
                         i == 0 ? "if (" + condition(cases_[i].second) + ") "
                         : last ? std::string("else ")
                                : "else if (" + condition(cases_[i].second) + ") ");
      out += indented(cases_[i].first);
      out += fmt::format("{:{}}}}\n", "", indent);
    }
    return out;
  }

 private:
  std::string condition(const std::vector<Choices>& combinations) const {
    // Only the choices that tell these combinations from the others need a test.
    std::set<std::string> alternatives;
    for (const Choices& c : combinations) {
      std::string all;
      std::size_t k = 0;
      for (const ParamInfo& p : info_.params) {
        if (p.kind != ParamKind::Choice) continue;
        const int index = c[k];
        if (p.choices.size() > 1 && !fixed_.count(p.name) && !covers(combinations, c, k, int(p.choices.size())))
          all += (all.empty() ? "" : " && ") + fmt::format("{} == {}", p.name, index);
        ++k;
      }
      alternatives.insert(all.empty() ? "1" : all);
    }
    std::string text;
    for (const std::string& a : alternatives)
      text += (text.empty() ? "" : " || ") + (alternatives.size() > 1 ? "(" + a + ")" : a);
    return text;
  }

  /// Whether every value of choice k stands in the combinations with the others as in c.
  static bool covers(const std::vector<Choices>& combinations, Choices c, std::size_t k, int size) {
    for (int i = 0; i < size; ++i) {
      c[k] = i;
      if (std::find(combinations.begin(), combinations.end(), c) == combinations.end()) return false;
    }
    return true;
  }

  const ModelInfo& info_;
  const ParamValues& fixed_;
  std::vector<std::pair<std::string, std::vector<Choices>>> cases_;
};

/// The arrays of all statements of a shader, each once: combinations of choices share their tables.
class SharedArrays {
 public:
  /// The statements, before which stand the arrays whose names other ones have taken.
  std::string without_shared(const forms::Recording& r) {
    std::string own;
    for (const std::string& array : r.arrays) {
      const std::string name = array.substr(0, array.find('['));
      if (known_.emplace(name, array).first->second != array) own += array;
    }
    return own + r.statements;
  }
  std::string print() const {
    std::string out;
    for (const auto& [name, array] : known_) out += array;
    return out;
  }

 private:
  std::map<std::string, std::string> known_;
};

/// Statements that look the albedo up.
class AlbedoText {
 public:
  AlbedoText(const ModelInfo& info, const measure::AlbedoTable& table, const ParamValues& fixed)
      : info_(info), table_(table), fixed_(fixed) {}

  std::string print() {
    ChoiceSwitch by_choice(info_, fixed_);
    const std::vector<Choices> combinations = choice_combinations(info_);
    for (std::size_t i = 0; i < combinations.size(); ++i)
      if (admits(info_, combinations[i], fixed_)) by_choice.add(combinations[i], terms(table_.terms.at(i)));
    const std::string body = by_choice.print(4);
    std::string out;
    for (std::size_t g = 0; g < table_.grids.size(); ++g)
      if (used_.count(int(g))) out += arrays(g);
    return out + positions_ + body;
  }

 private:
  std::string terms(const std::vector<measure::AlbedoTerm>& list) {
    std::string out = "    Albedo = 0.0;\n";
    for (const measure::AlbedoTerm& t : list) {
      std::string product = lookup(t.grid);
      for (const std::string& c : t.colors) product = operand(c) + " * " + product;
      out += fmt::format("    Albedo += {};\n", product);
    }
    return out;
  }

  /// A parameter's name, or its value where it is fixed.
  std::string operand(const std::string& name) const {
    const auto it = fixed_.find(name);
    if (it == fixed_.end()) return name == "cos_theta_o" ? "wo_z" : name;
    if (const auto* c = std::get_if<std::array<double, 3>>(&it->second)) return print::color(*c);
    return number(std::get<double>(it->second));
  }

  std::string scaled(const measure::TableAxis& axis) const {
    const std::string x = operand(axis.name);
    switch (axis.scale) {
      case AxisScale::Log:
        return fmt::format("log(max({}, {}))", x, number(axis.values.front()));
      case AxisScale::Log1p:
        return fmt::format("log(1.0 + {})", x);
      default:
        return x;
    }
  }

  std::string lookup(int index) {
    const measure::AlbedoGrid& g = table_.grids.at(std::size_t(index));
    if (g.axes.empty()) {
      if (g.channels == 1) return number(g.values[0]);
      return print::color({g.values[0], g.values[1], g.values[2]});
    }
    if (g.axes.size() > 4)
      input_error("{}: the albedo table has {} axes, and OSL look-ups exist for 4", info_.name, g.axes.size());
    if (g.values.size() > kMaxArray)
      input_error("{}: the albedo table has {} numbers, and an OSL array may have {}", info_.name, g.values.size(),
                  kMaxArray);
    if (used_.insert(index).second)
      for (std::size_t a = 0; a < g.axes.size(); ++a)
        positions_ += fmt::format("    float position_{}_{} = brdfc_position(knots_{}_{}, {}, {});\n", index, a, index,
                                  a, g.axes[a].values.size(), scaled(g.axes[a]));
    if (g.channels == 1) return call(g, index, "");
    return fmt::format("color({}, {}, {})", call(g, index, "_r"), call(g, index, "_g"), call(g, index, "_b"));
  }

  static std::string call(const measure::AlbedoGrid& g, int index, const std::string& channel) {
    std::string text = fmt::format("brdfc_table{}(table{}_{}", g.axes.size(), channel, index);
    for (const measure::TableAxis& a : g.axes) text += fmt::format(", {}", a.values.size());
    for (std::size_t a = 0; a < g.axes.size(); ++a) text += fmt::format(", position_{}_{}", index, a);
    return text + ")";
  }

  std::string arrays(std::size_t index) const {
    const measure::AlbedoGrid& g = table_.grids[index];
    std::string out;
    for (std::size_t a = 0; a < g.axes.size(); ++a) {
      std::vector<double> knots = g.axes[a].values;
      for (double& k : knots)
        k = g.axes[a].scale == AxisScale::Log ? std::log(k) : g.axes[a].scale == AxisScale::Log1p ? std::log1p(k) : k;
      out += print::array(fmt::format("knots_{}_{}", index, a), knots);
    }
    if (g.channels == 1) return out + print::array(fmt::format("table_{}", index), {g.values.begin(), g.values.end()});
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<double> channel;
      for (std::size_t i = c; i < g.values.size(); i += 3) channel.push_back(g.values[i]);
      out += print::array(fmt::format("table_{}_{}", "rgb"[c], index), channel);
    }
    return out;
  }

  const ModelInfo& info_;
  const measure::AlbedoTable& table_;
  const ParamValues& fixed_;
  std::set<int> used_;
  std::string positions_;
};

std::string closure_text(const forms::RecordedClosure& closure, std::size_t i) {
  const std::string n = closure.turned ? fmt::format("normal_{}", i) : "frame_n";
  const auto microfacet = [&](const char* distribution) {
    // The viewer's direction lies in the plane of incidence. Along the normal, where it is no tangent, facets are not
    // stretched by it, and Cycles takes none.
    const std::string tangent = closure.stretched == Tangent::View      ? "I"
                                : closure.stretched == Tangent::Surface ? fmt::format("tangent_{}", i)
                                                                        : "vector(0.0)";
    return fmt::format("weight_{0} * microfacet(\"{1}\", {2}, {3}, alpha_{0}, {4}_{0}, 1.0, 0)", i, distribution, n,
                       tangent, closure.stretched == Tangent::None ? "alpha" : "alpha_across");
  };
  switch (closure.kind) {
    case ClosureKind::Diffuse:
      return fmt::format("weight_{} * brdfc_diffuse({})", i, n);
    case ClosureKind::Burley:
      return fmt::format("weight_{} * burley_diffuse_bsdf({}, color(1), 0.0)", i, n);
    case ClosureKind::DiffuseRamp:
      return fmt::format("weight_{} * diffuse_ramp({}, ramp_{})", i, n, i);
    case ClosureKind::Reflection:
      return fmt::format("weight_{} * reflection({})", i, n);
    case ClosureKind::Refraction:
      return fmt::format("weight_{} * refraction({}, ior_{})", i, n, i);
    case ClosureKind::PhongRamp:
      return fmt::format("weight_{} * phong_ramp({}, exponent_{}, ramp_{})", i, n, i, i);
    case ClosureKind::Ggx:
      return microfacet("ggx");
    case ClosureKind::Beckmann:
      return microfacet("beckmann");
  }
  throw std::logic_error("no OSL for this closure");
}

/// Three numbers in [0, 1) that draw a direction.
constexpr const char* kDraws =
    "    vector u_all = brdfc_random(0, path_length);\n    float u_0 = u_all[0], u_1 = u_all[1], u_2 = u_all[2];\n";

/// Lamps and rest of an aimed form: one evaluation of the model, in a loop over the lamps and the drawn direction.
class AimedText {
 public:
  /// `through`: whether the model may scatter through the surface.
  AimedText(const ModelInfo& info, const ParamValues& fixed, int lamps, bool through)
      : draw_(info, fixed), value_(info, fixed), lamps_(lamps), through_(through) {}

  /// The base's recording.
  forms::Recording add(const Choices& choices, const forms::AimedRecording& r, SharedArrays& arrays) {
    draw_.add(choices, arrays.without_shared(r.draw));
    value_.add(choices, arrays.without_shared(r.value));
    operations_ = std::max(operations_, r.draw.operations + r.value.operations);
    return r.base;
  }

  int operations() const {
    const forms::AimedSteps& steps = forms::aimed_steps(0);
    if (lamps_ == 0) return operations_ + steps.alone.operations;
    int all = operations_ + steps.rest.operations;
    for (const forms::Recording* r :
         {&steps.above, &steps.room, &steps.aim, &steps.less, &steps.send, &steps.toss, &steps.under, &steps.meet})
      all += r->operations;
    return all;
  }

  std::string print() const {
    const forms::AimedSteps& steps = forms::aimed_steps(0);
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
        "    // The lamps, and at last the direction that was drawn.\n"
        "    for (int lamp = 0; lamp <= lamps; lamp++) {\n"
        "        float wi_x, wi_y, wi_z, lobe_height, lamp_emphasis;\n"
        "        if (lamp < lamps) {\n"
        "            vector centre_here, across_here, along_here;\n            float disk_here, lobe_room = 1.0;\n"
        "            if (brdfc_lamp(lamp_place[lamp], lamp_turn[lamp], lamp_scale[lamp], lamp_shape[lamp], "
        "centre_here, across_here,\n"
        "                           along_here, disk_here) == 0)\n"
        "                continue;\n"
        "            lamp_centre[lobes] = brdfc_local(centre_here, frame_t, frame_b, frame_n);\n"
        "            lamp_across[lobes] = brdfc_local(across_here, frame_t, frame_b, frame_n);\n"
        "            lamp_along[lobes] = brdfc_local(along_here, frame_t, frame_b, frame_n);\n"
        "            lamp_disk[lobes] = disk_here;\n";
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
    out +=
        "    if (lamp_met > 0.0) {\n"
        "        ray_x = drawn_x;\n        ray_y = drawn_y;\n        ray_z = drawn_z;\n    }\n";
    // Each joins the sum from the left: Cycles walks it without a stack. The weight is a colour: see kPoolNode.
    std::string ramp;
    for (const double c : forms::aimed_ramp()) ramp += (ramp.empty() ? "" : ", ") + number(c);
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
    return fmt::format("            for (int earlier = 0; earlier < lobes; earlier++)\n                {}{{\n",
                       condition) +
           indented(statements, 5) + "                }\n";
  }

  ChoiceSwitch draw_, value_;
  int lamps_, operations_ = 0;
  bool through_;
};

}  // namespace

Shader write_shader(const Model& model, RepresentationKind kind, const measure::AlbedoTable& table,
                    const ParamValues& given, const Cosines& views, int max_lamps, forms::AimedBase base) {
  const ModelInfo& info = model.info();
  ParamValues fixed = given;
  for (const auto& [name, value] : forms::form_values(model, kind, given))
    if (fixed.emplace(name, value).first->second != value)
      input_error("{}: the {} form exists only for {}", info.name, name_of(kind), format_values(info, {{name, value}}));
  const bool sampled = kind == RepresentationKind::Sampled, aimed = kind == RepresentationKind::Aimed;
  Shader shader;
  shader.name = fmt::format("brdfc_{}_{}", info.name, name_of(kind));

  std::vector<forms::RecordedClosure> kinds;
  ChoiceSwitch statements(info, fixed), mirror(info, fixed);
  AimedText aimed_text(info, fixed, max_lamps, model.has_through());
  SharedArrays arrays;
  int operations = 0, mirror_operations = 0;
  // A drawn direction is a lobe. Where it may be another closure, OSL makes a product of that and its weight.
  const int ray_bytes = pool_bytes(ClosureKind::PhongRamp) + (model.has_through() ? kPoolNode : 0);
  for (const Choices& choices : choice_combinations(info)) {
    if (!admits(info, choices, fixed)) continue;
    const ParamValues values = with_choices(info, choices, fixed);
    const forms::Recording r = aimed
                                   ? aimed_text.add(choices, forms::record_aimed(model, values, 0, base, views), arrays)
                                   : forms::record(model, kind, values, 4, views);
    operations = std::max(operations, r.operations);
    statements.add(choices, arrays.without_shared(r));
    if (!kinds.empty() && kinds != r.closures)
      throw std::logic_error(info.name + ": closures must be the same for every combination of choices");
    kinds = r.closures;
    if ((sampled || aimed) && model.has_mirror()) {
      const forms::Recording m = forms::record_mirror(model, values, 0);
      mirror_operations = std::max(mirror_operations, m.operations);
      mirror.add(choices, arrays.without_shared(m));
    }
  }
  shader.operations = operations + mirror_operations;

  std::string normal = "    vector frame_n = normalize(Normal);\n";
  if (kind == RepresentationKind::Fitted)
    normal += fmt::format("    frame_n = brdfc_facing(frame_n, {});\n", fit::kLowestView);
  std::string body = normal;
  body +=
      "    vector frame_t, frame_b;\n"
      "    brdfc_frame(frame_n, Tangent, frame_t, frame_b);\n"
      "    // Towards the viewer: I in Cycles points away from the surface.\n"
      "    float wo_x = dot(I, frame_t);\n    float wo_y = dot(I, frame_b);\n    float wo_z = dot(I, frame_n);\n\n";
  if (model.two_sided())
    body +=
        "    // frame_n is on the viewer's side; the model's z leaves the object.\n"
        "    float side = backfacing() ? -1.0 : 1.0;\n";
  if (model.has_medium() || sampled || aimed)
    body += "    float path_length = 0;\n    getattribute(\"path:ray_length\", path_length);\n";
  body += arrays.print();
  std::vector<std::string> terms;
  if ((sampled || aimed) && model.has_mirror()) body += "    color mirror_weight;\n" + block(mirror.print(0), 1);
  if (sampled) {
    body += std::string(kDraws) + "    float wi_x, wi_y, wi_z;\n    color weight;\n" + statements.print(4) +
            "    vector wi = frame_t * wi_x + frame_b * wi_y + frame_n * wi_z;\n";
    terms.push_back(model.has_through() ? "brdfc_ray_anywhere(weight, wi, I, frame_n)" : "weight * brdfc_ray(wi, I)");
    shader.slots = slots(ClosureKind::PhongRamp);
    shader.closure_bytes = ray_bytes;
  } else {
    for (std::size_t c = 0; c < kinds.size(); ++c) {
      const ClosureKind closure = kinds[c].kind;
      body += fmt::format("    color weight_{};\n", c);
      if (has_ramp(closure)) body += fmt::format("    color ramp_{}[{}];\n", c, kRampSize);
      if (closure == ClosureKind::PhongRamp) body += fmt::format("    float exponent_{};\n", c);
      if (has_facets(closure)) body += fmt::format("    float alpha_{};\n", c);
      if (kinds[c].stretched != Tangent::None) body += fmt::format("    float alpha_across_{};\n", c);
      if (kinds[c].stretched == Tangent::Surface)
        body += fmt::format("    float tangent_{0}_x, tangent_{0}_y, tangent_{0}_z;\n", c);
      if (closure == ClosureKind::Refraction) body += fmt::format("    float ior_{};\n", c);
      if (kinds[c].turned) body += fmt::format("    float normal_{0}_x, normal_{0}_y, normal_{0}_z;\n", c);
      shader.facets = shader.facets || (has_facets(closure) && !aimed);
      terms.push_back(closure_text(kinds[c], c));
      shader.slots += slots(closure);
      shader.closure_bytes += pool_bytes(closure);
    }
    body += aimed ? block(statements.print(0), 1) : statements.print(4);
    for (std::size_t c = 0; c < kinds.size(); ++c)
      if (kinds[c].division != forms::Division::Done) {
        const std::string weight = fmt::format("weight_{}", c);
        body += fmt::format(
            "    for (int entry = 0; entry < {}; entry++)\n        ramp_{}[entry] /= {};\n", kRampSize, c,
            kinds[c].division == forms::Division::ByLargest ? fmt::format("brdfc_max_component({})", weight) : weight);
        ++shader.operations;
      }
    if (forms::is_fit(kind) || (aimed && base == forms::AimedBase::Fitted))
      for (const std::string& name : fit::roles_of(model, fixed).with(fit::Role::Factor)) {
        for (std::size_t c = 0; c < kinds.size(); ++c)
          if (kinds[c].kind != ClosureKind::Reflection) body += fmt::format("    weight_{} *= {};\n", c, name);
        ++shader.operations;
      }
    if (aimed) {
      // Filter Glossy makes facets rougher behind a rough surface, and without caustics Cycles drops them there: then
      // the rest, which takes off what they were to give, would be wrong. Light that has come so far is noisy anyway.
      for (std::size_t c = 0; c < kinds.size(); ++c)
        if (has_facets(kinds[c].kind))
          body += fmt::format("    if (raytype(\"camera\") == 0)\n        weight_{} = 0.0;\n", c);
      body += aimed_text.print();
      shader.lamps = max_lamps;
      shader.operations += aimed_text.operations();
      shader.slots += (max_lamps + 1) * slots(ClosureKind::PhongRamp);
      shader.closure_bytes += ray_bytes;
      shader.lamp_bytes = max_lamps > 0 ? pool_bytes(ClosureKind::PhongRamp) + kPoolNode : 0;
      if (max_lamps > 0) terms.push_back("aimed");
      // As a colour: see kPoolNode.
      if (!model.has_through()) body += "    color rest_followed = rest_weight;\n";
      const char* ray = model.has_through() ? "brdfc_signed_ray_anywhere(rest_weight, rest_colour, {}, I, frame_n)"
                                            : "rest_followed * brdfc_ray_coloured({}, I, rest_colour)";
      terms.push_back(
          fmt::format(fmt::runtime(ray), max_lamps > 0 ? "frame_t * ray_x + frame_b * ray_y + frame_n * ray_z"
                                                       : "frame_t * drawn_x + frame_b * drawn_y + frame_n * drawn_z"));
    }
    for (std::size_t c = 0; c < kinds.size(); ++c) {
      if (kinds[c].stretched == Tangent::Surface)
        body += fmt::format(
            "    vector tangent_{0} = frame_t * tangent_{0}_x + frame_b * tangent_{0}_y + frame_n * tangent_{0}_z;\n",
            c);
      if (kinds[c].turned)
        body += fmt::format(
            "    normal normal_{0} = normalize(frame_t * normal_{0}_x + frame_b * normal_{0}_y + frame_n * "
            "normal_{0}_z);\n",
            c);
    }
  }
  if ((sampled || aimed) && model.has_mirror()) {
    terms.push_back("mirror_weight * reflection(frame_n)");
    shader.slots += slots(ClosureKind::Reflection);
    shader.closure_bytes += pool_bytes(ClosureKind::Reflection);
  }
  shader.closures = int(terms.size()) + std::max(shader.lamps - 1, 0);
  shader.closure_bytes += std::max(int(terms.size()) - (shader.lamps > 0 ? 1 : 0) - 1, 0) * kPoolNode;
  if (shader.slots > kMaxClosures)
    input_error("{}: the {} form needs {} closure slots, and Cycles keeps {}", info.name, name_of(kind), shader.slots,
                kMaxClosures);
  body += "    BSDF = " + print::balanced_sum(terms) + ";\n\n";
  std::string of_albedo;
  if (model.has_scatter()) {
    of_albedo = AlbedoText(info, table, fixed).print();
    if (of_albedo.size() <= kMaxAlbedoText) body += std::exchange(of_albedo, "");
  } else {
    body += "    Albedo = weight_0";
    for (std::size_t c = 1; c < kinds.size(); ++c) body += fmt::format(" + weight_{}", c);
    body += ";\n";
  }

  // Each ends a line; the semicolons of a loop's head do not.
  for (std::size_t at = body.find(";\n"); at != std::string::npos; at = body.find(";\n", at + 1)) ++shader.statements;

  std::string parameters;
  for (const ParamInfo& p : info.params) {
    if (fixed.count(p.name)) continue;
    if (p.kind == ParamKind::Choice && p.choices.size() == 1) continue;  // nothing to choose
    if (print::is_osl_word(p.name))
      input_error("{}: a parameter may not be called '{}', which is a word of OSL or of the generator", info.name,
                  p.name);
    parameters += parameter(p);
  }
  const auto text = [&](const std::string& name, const std::string& what, const std::string& sockets,
                        const std::string& statements) {
    return print::comment(fmt::format("{}: {}. Generated by brdfc {}.", info.label, info.paper, BRDFC_VERSION)) +
           print::comment(fmt::format("{}. {}", what, info.equations)) +
           "// SPDX-License-Identifier: GPL-3.0-or-later\n\n" +
           print::narrow(print::library_for(statements) + fmt::format("\nshader {}(\n", name) + parameters + sockets +
                         ")\n{\n" + statements + "}\n");
  };
  const char* albedo_output = "    output color Albedo = 0";
  std::string sockets;
  for (int i = 1; i <= shader.lamps; ++i)
    for (const char* what : {"Place", "Turn", "Scale", "Shape"})
      sockets += fmt::format("    vector Lamp{}{} = vector(0.0),\n", what, i);
  sockets +=
      "    normal Normal = N,\n    vector Tangent = vector(0, 0, 0),\n"
      "    output closure color BSDF = 0";
  if (of_albedo.empty()) sockets += fmt::format(",\n{}", albedo_output);
  shader.source = text(shader.name, fmt::format("Form: {}", name_of(kind)), sockets, body);
  if (!of_albedo.empty())
    shader.albedo = text(shader.name + "_albedo", fmt::format("Albedo of the form: {}", name_of(kind)),
                         fmt::format("    normal Normal = N,\n{}", albedo_output),
                         normal + "    float wo_z = dot(I, frame_n);\n" + of_albedo);
  return shader;
}

}  // namespace brdfc::pack
