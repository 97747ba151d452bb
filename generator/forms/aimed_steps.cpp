// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/aimed_steps.h"

#include <fmt/format.h>

#include <utility>

#include "forms/aimed.h"

namespace brdfc::forms {
namespace {

/// An OSL vector as three inputs.
Vec3<Expr> input_vector(const std::string& name) {
  return {Expr::input(name + "[0]"), Expr::input(name + "[1]"), Expr::input(name + "[2]")};
}

AimedSteps record_steps() {
  Recorder recorder;
  AimedSteps steps;
  const auto record_step = [&](const auto& outputs) {
    Program program;
    outputs(program);
    return recording_of(std::move(program), {});
  };
  const auto lobe_named = [](const std::string& name) {
    const auto of = [&](const char* what) { return fmt::format("{}_{}", name, what); };
    AimedLobe<Expr> lobe;
    lobe.towards = input_vector(of("towards"));
    lobe.half = input_vector(of("half"));
    lobe.exponent = Expr::input(of("exponent"));
    lobe.sinRadius = Expr::input(of("radius"));
    lobe.cosEnd = Expr::input(of("end"));
    lobe.extent = Expr::input(of("extent"));
    lobe.rise = Expr::input(of("rise"));
    return lobe;
  };
  const auto patch_named = [](const std::string& name) {
    const auto of = [&](const char* what) { return fmt::format("{}_{}", name, what); };
    return LampPatch<Expr>{input_vector(of("centre")), input_vector(of("across")), input_vector(of("along")),
                           Expr::input(of("disk"))};
  };
  const AimedLobe<Expr> earlier = lobe_named("earlier");
  const LampPatch<Expr> patch = patch_named("lamp");
  const Expr lobes = Expr::input("lobes");
  const LampBeam<Expr> beam{input_vector("beam"), Expr::input("beam_edge"), Expr::input("beam_blend")};
  steps.bounds = record_step([&](Program& p) {
    const LampPatch<Expr> bounds = lit_bounds(patch, beam);
    const auto output_vector = [&](const std::string& name, const Vec3<Expr>& v) {
      p.output(name + "[0]", v.x);
      p.output(name + "[1]", v.y);
      p.output(name + "[2]", v.z);
    };
    output_vector("lit_centre", bounds.centre);
    output_vector("lit_across", bounds.across);
    output_vector("lit_along", bounds.along);
    p.output("lit_disk", bounds.disk);
  });
  steps.above = record_step([&](Program& p) { p.output("lamp_above", highest(patch)); });
  steps.room = record_step([&](Program& p) {
    p.output("lobe_room", minimum(Expr::input("lobe_room"), room_beside(patch.centre, earlier)));
  });
  steps.aim = record_step([&](Program& p) {
    const AimedLamp<Expr> lamp =
        aim_at(patch, Expr::input("lobe_room"), Expr::input("v_1"), Expr::input("v_2"), input3("wo"));
    p.output("wi", lamp.wi);
    p.output("to_lamp", lamp.lobe.towards);
    p.output("to_half", lamp.lobe.half);
    p.output("lobe_exponent", lamp.lobe.exponent);
    p.output("lobe_radius", lamp.lobe.sinRadius);
    p.output("lobe_end", lamp.lobe.cosEnd);
    p.output("lobe_extent", lamp.lobe.extent);
    p.output("lobe_rise", lamp.lobe.rise);
    p.output("lobe_height", lamp.height);
    p.output("lamp_density", lamp.density);
    p.output("lamp_rise", lamp.mean_rise);
    p.output("lamp_solid_angle", lamp.solid_angle);
  });
  const Vec3<Expr> horizon = input_vector("horizon");
  steps.low = record_step([&](Program& p) { p.output("lamp_low", lowest(patch, horizon)); });
  steps.cut = record_step([&](Program& p) {
    AimedLamp<Expr> lamp;
    lamp.lobe = lobe_named("lobe");
    lamp.mean_rise = Expr::input("lamp_rise");
    const AimedLamp<Expr> cut = cut_off(lamp, patch, horizon, Expr::input("v_1"), Expr::input("v_2"));
    p.output("wi", cut.wi);
    p.output("lamp_density", cut.density);
    p.output("lamp_rise", cut.mean_rise);
  });
  steps.lit = record_step([&](Program& p) {
    AimedLamp<Expr> lamp;
    lamp.mean_rise = Expr::input("lamp_rise");
    const AimedLamp<Expr> shown =
        lit(lamp, lit_point(patch, patch_named("full"), beam, lobe_named("lobe").half, horizon, Expr::input("lamp_cut"),
                            Expr::input("v_1"), Expr::input("v_2"), Expr::input("v_3")));
    p.output("wi", shown.wi);
    p.output("lamp_density", shown.density);
    p.output("lamp_rise", shown.mean_rise);
  });
  steps.emphasis = record_step([&](Program& p) {
    AimedLamp<Expr> lamp;
    lamp.lobe = lobe_named("lobe");
    lamp.wi = input3("wi");
    lamp.density = Expr::input("lamp_density");
    lamp.mean_rise = Expr::input("lamp_rise");
    p.output("lamp_emphasis", emphasis_of(lamp));
  });
  const Rgb<Expr> value = Rgb<Expr>::input("excess");
  const Expr density = Expr::input("drawn_density");
  steps.less = record_step([&](Program& p) {
    p.output("excess", value - Rgb<Expr>::input("earlier_value") * evaluate(earlier, input3("wi")));
  });
  steps.send = record_step([&](Program& p) {
    AimedLamp<Expr> lamp;
    lamp.height = Expr::input("lobe_height");
    lamp.lobe.extent = Expr::input("lobe_extent");
    lamp.solid_angle = Expr::input("lamp_solid_angle");
    const Sent<Expr> sent = send(lamp, Expr::input("lamp_emphasis"), value, density);
    p.output("lobe_value", sent.value);
    p.output("lobe_weight", sent.weight);
    p.output("lobe_colour", sent.colour);
  });
  steps.toss = record_step([&](Program& p) {
    const Toss<Expr> tossed = toss(Expr::input("u_0"), lobes);
    p.output("tossed", tossed.lobe);
    p.output("u_0", tossed.u);
  });
  steps.under = record_step([&](Program& p) {
    p.output("drawn", sample_under(lobe_named("chosen"), Expr::input("u_1"), Expr::input("u_2")));
  });
  const Met<Expr> before{Rgb<Expr>::input("covered"), Rgb<Expr>::input("covered_before"), Expr::input("lamp_met"),
                         Expr::input("density_under"), input3("ray")};
  steps.meet = record_step([&](Program& p) {
    const Met<Expr> met = meet(before, patch_named("earlier"), earlier, Expr::input("earlier_solid_angle"),
                               Rgb<Expr>::input("earlier_value"), input3("drawn"));
    p.output("covered_before", met.before);  // the sum before the current lobe is added
    p.output("covered", met.covered);
    p.output("lamp_met", met.solid_angle);
    p.output("density_under", met.density);
    p.output("ray", met.ray);
  });
  const auto record_rest = [&](const Expr& count, const Met<Expr>& met) {
    return record_step([&](Program& p) {
      const Rest<Expr> left = rest(value, density, count, met);
      p.output("rest_weight", left.weight);
      p.output("rest_colour", left.colour);
    });
  };
  steps.rest = record_rest(lobes, before);
  steps.alone = record_rest(Expr(0), Met<Expr>());
  return steps;
}

}  // namespace

const AimedSteps& aimed_steps() {
  static const AimedSteps steps = record_steps();
  return steps;
}

}  // namespace brdfc::forms
