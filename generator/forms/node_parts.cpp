// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/node_parts.h"

#include <fmt/format.h>

#include <stdexcept>

#include "forms/node_lamps.h"
#include "model/horizon.h"
#include "trace/program.h"

namespace brdfc::forms {
namespace {

using Json = nlohmann::ordered_json;
using print::NodeOperand;
using print::NodeProgram;

Json operand_json(const NodeOperand& o) {
  if (o.result >= 0) return "$" + std::to_string(o.result);
  if (!o.input.empty()) return o.input;
  if (!o.color) return float(o.value[0]);
  return {float(o.value[0]), float(o.value[1]), float(o.value[2])};
}

/// Records a program by itself.
template <class Outputs> NodeProgram recorded(const Outputs& outputs) {
  Recorder recorder;
  Program program;
  outputs(program);
  return print::node_program(program, node_vectors());
}

LampSlot<Expr> slot_input() {
  return {input3("place"), input3("turn"), input3("scale"), input3("shape"), Expr::input("kind"), Expr::input("most")};
}
LampAxes<Expr> axes_input() {
  return {input3("across"), input3("along"), input3("away"), Expr::input("half_across"), Expr::input("half_along")};
}

LitArea<Expr> lit_input() {
  return {input3("lit_place"), Expr::input("lit_across"), Expr::input("lit_along"), Expr::input("is_lit")};
}

LampPart<Expr> part_input() { return {Expr::input("index"), Expr::input("side_across"), Expr::input("side_along")}; }
void take_part(LampCone<Expr>& cone) {
  cone.part_across = Expr::input("part_across");
  cone.part_along = Expr::input("part_along");
}

}  // namespace

const std::set<std::string>& node_vectors() {
  static const std::set<std::string> names = {"across", "aim",   "along", "at",   "away",  "axis",  "lit_place",
                                              "normal", "other", "place", "ray",  "scale", "shape", "towards",
                                              "true",   "turn",  "drawn", "view", "wi",    "wo"};
  return names;
}

Json json_of(const NodeProgram& program) {
  Json inputs = Json::array(), operations = Json::array(), outputs = Json::array();
  for (const auto& [name, color] : program.inputs) inputs.push_back({name, color ? "VECTOR" : "FLOAT"});
  for (const print::NodeOperation& o : program.operations) {
    Json line = {o.kind};
    for (const NodeOperand& a : o.operands) line.push_back(operand_json(a));
    operations.push_back(line);
  }
  for (const auto& [name, o] : program.outputs)
    outputs.push_back({name, o.color ? "VECTOR" : "FLOAT", operand_json(o)});
  return {{"inputs", inputs}, {"operations", operations}, {"outputs", outputs}, {"live", program.live}};
}

const char* kind_of(ClosureKind kind) {
  switch (kind) {
    case ClosureKind::Diffuse:
    case ClosureKind::OrenNayar:  // the same node, with a roughness
      return "diffuse";
    case ClosureKind::DiffuseToon:
      return "cone";
    case ClosureKind::Ggx:
      return "ggx";
    case ClosureKind::Beckmann:
      return "beckmann";
    case ClosureKind::Reflection:
      return "mirror";
    case ClosureKind::Refraction:
      return "refraction";
    default:
      throw std::logic_error("a closure that no node makes");
  }
}

Json bounds_json(const ModelInfo& info, const ParamValues& fixed) {
  Json bounds = Json::object();
  for (const ParamInfo& p : info.params) {
    if (fixed.count(p.name)) continue;
    const auto grey = [](double value) { return Json{value, value, value}; };
    if (p.kind == ParamKind::Number) bounds[p.name] = {p.min, p.max};
    if (p.kind == ParamKind::Color) bounds[p.name] = {grey(p.min), p.may_exceed ? Json() : grey(p.max)};
  }
  return bounds;
}

NodeProgram record_bend() {
  return recorded([](Program& p) {
    const Vec3<Expr> g = input3("true"), wo = input3("view"), n = input3("normal");
    const Condition bends = mirror_rise(g, wo, n) < Expr(0.0) && Expr::input("strand") < Expr(0.5);
    p.output("normal", select(bends, bent_normal(g, wo, n), n));
  });
}
NodeProgram record_raise() {
  return recorded([](Program& p) { p.output("wo", raise_to_horizon(input3("wo"))); });
}
NodeProgram record_axes() {
  return recorded([](Program& p) {
    const LampAxes<Expr> axes = lamp_axes(slot_input());
    p.output("across", axes.across);
    p.output("along", axes.along);
    p.output("away", axes.away);
    p.output("half_across", axes.half_across);
    p.output("half_along", axes.half_along);
  });
}
NodeProgram record_cone() {
  return recorded([](Program& p) {
    const LitArea<Expr> lit = lit_input();
    const LampCone<Expr> cone =
        cone_of(lit.of(slot_input()), lit.of(axes_input()), input3("at"), input3("view"), input3("true"));
    p.output("towards", cone.towards);
    p.output("aim", cone.aim);
    p.output("part_across", cone.part_across);
    p.output("part_along", cone.part_along);
    p.output("drop", cone.drop);
    p.output("of_cones", cone.of_cones);
    p.output("chord", cone.chord);
    p.output("reach", cone.reach);
    p.output("inner", cone.inner);
    p.output("flat", cone.flat);
    p.output("used", cone.used);
    // A lamp that does not shine here would take the light of others from the directions of its cone.
    const Expr spot_lit = spot_cone(slot_input()).is_lit(dot(input3("away"), cone.aim), cone.of_cones / Expr(kPi));
    p.output("active", cone.active * lit.is_lit * spot_lit);
    p.output("above", cone.above);
    p.output("layout", cone.cones.layout);
    p.output("clear", cone.clear);
    p.output("moved", cone.cones.moved);
  });
}
NodeProgram record_lit() {
  return recorded([](Program& p) {
    const LitArea<Expr> lit = lit_area(slot_input(), axes_input(), input3("at"));
    p.output("lit_place", lit.place);
    p.output("lit_across", lit.half_across);
    p.output("lit_along", lit.half_along);
    p.output("is_lit", lit.is_lit);
  });
}
NodeProgram record_count() {
  return recorded([](Program& p) { p.output("count", count_of(Expr::input("layout"))); });
}
NodeProgram record_cone_at() {
  return recorded([](Program& p) {
    LampCone<Expr> cone;
    cone.aim = input3("aim");
    cone.cones.layout = Expr::input("layout");
    cone.cones.moved = Expr::input("moved");
    take_part(cone);
    cone.of_cones = Expr::input("of_cones");
    const LitArea<Expr> lit = lit_input();
    const ConeOfPart<Expr> found = cone_at(lit.of(slot_input()), lit.of(axes_input()), cone, part_input());
    p.output("mean", mean_light(slot_input(), axes_input(), found.axis, found.chord));
    p.output("axis", found.axis);
    p.output("of_part", found.chord);
  });
}
NodeProgram record_aside() {
  return recorded([](Program& p) {
    const LitArea<Expr> lit = lit_input();
    const ConeAside<Expr> aside =
        cone_aside(lit.of(slot_input()), lit.of(axes_input()), input3("at"), input3("towards"), Expr::input("inner"),
                   input3("other"), Expr::input("other_radius"));
    p.output("axis", aside.towards);
    p.output("of_cones", aside.of_cones);
    p.output("clear", aside.clear);
    p.output("fits", aside.fits);
  });
}
NodeProgram record_flat() {
  return recorded([](Program& p) {
    LampCone<Expr> cone;
    cone.of_cones = Expr::input("of_cones");
    take_part(cone);
    cone.cones.layout = Expr::input("layout");
    const LitArea<Expr> lit = lit_input();
    const FlatPoint<Expr> point = flat_point(lit.of(slot_input()), lit.of(axes_input()), input3("at"), cone,
                                             part_input(), Expr::input("u_0"), Expr::input("u_1"));
    p.output("light", light_from(slot_input(), axes_input(), input3("at"), point.wi));
    p.output("wi", point.wi);
    p.output("emphasis", point.emphasis);
    p.output("bounds", point.bounds);
  });
}
NodeProgram record_beam() {
  return recorded([](Program& p) {
    const SpotCone<Expr> spot = spot_cone(slot_input());
    const Vec3<Expr> away = input3("away");
    p.output("beam",
             spot.light(dot(away, input3("wi"))) / spot.mean(dot(away, input3("axis")), Expr::input("of_part")));
  });
}
NodeProgram record_met() {
  return recorded([](Program& p) {
    LampCone<Expr> cone;
    cone.towards = input3("towards");
    cone.chord = Expr::input("chord");
    cone.of_cones = Expr::input("of_cones");
    cone.drop = Expr::input("drop");
    take_part(cone);
    const LitArea<Expr> lit = lit_input();
    p.output("met", met_part(lit.of(slot_input()), lit.of(axes_input()), input3("at"), cone, input3("ray"),
                             Expr::input("density")));
  });
}
NodeProgram record_lobe() {
  return recorded([](Program& p) {
    LampCone<Expr> cone;
    cone.chord = Expr::input("chord");
    cone.flat = Expr::input("flat");
    cone.of_cones = Expr::input("of_cones");
    cone.clear = Expr::input("clear");
    cone.cones.layout = Expr::input("layout");
    cone.drop = Expr::input("drop");
    const Expr emphasis = select(cone.flat > Expr(0.5), Expr::input("emphasis"), times_cone(cone, cone.of_cones));
    const Expr share = select(cone.flat > Expr(0.5), Expr::input("light") / Expr::input("mean"), Expr::input("beam"));
    const ToonLobe<Expr> lobe = toon_lobe(
        input3("shape"), cone, Expr::input("of_part"), Expr::input("bounds"), Expr::input("index"), Expr::input("pick"),
        emphasis, share, Expr::input("density"), Expr::input("room"), Rgb<Expr>::input("value"), Expr::input("u_2"));
    p.output("color", lobe.color);
    p.output("size", lobe.size);
    p.output("whole", lobe.whole);
  });
}
NodeProgram record_rest() {
  return recorded([](Program& p) {
    // SVM takes a quotient by 0 for 0: such a direction is none.
    const Expr left = (Expr(1.0) - Expr::input("lost")) / Expr::input("density");
    const Rgb<Expr> weight = Rgb<Expr>::input("value") * left;
    p.output("color", weight * kept(max_component(weight), Expr::input("u")));
  });
}

}  // namespace brdfc::forms
