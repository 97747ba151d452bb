// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/representation.h"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>

#include "core/sequence.h"
#include "fit/fit.h"
#include "fit/roles.h"
#include "fit/twin.h"
#include "fit/view.h"
#include "forms/aimed.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/horizon.h"
#include "model/inputs.h"
#include "model/sampling.h"
#include "print/osl_program.h"
#include "trace/program.h"

namespace brdfc::forms {
namespace {

/// What a shader has for parameters: statements may not declare them, not even those that they do not read.
std::vector<std::string> parameter_names(const Model& model) {
  std::vector<std::string> names;
  for (const ParamInfo& p : model.info().params) names.push_back(p.name);
  return names;
}

/// The shader's frame has its normal on the viewer's side. For a model of two sides z is turned outwards by `side`.
Vec3<Expr> recorded_wo(const Model& model, const Brdf<Expr>& brdf) {
  Vec3<Expr> wo = raise_to_horizon(input3("wo"));
  if (measure::two_sided(model, brdf)) wo.z = wo.z * Expr::input("side");
  return wo;
}

/// What the medium has left of the light that comes from this hit; `distance` is that to the hit before.
template <class T> Rgb<T> medium(const Brdf<T>& brdf, const T& side, const T& distance) {
  return select(side < T(0), brdf.transmittance(distance), Rgb<T>(T(1)));
}

/// The closures of an exact form, as the shader has to weigh them.
std::optional<ClosureSum<Expr>> recorded_exact(const Model& model, const Brdf<Expr>& brdf) {
  auto sum = brdf.exact(recorded_wo(model, brdf));
  if (sum && model.has_medium()) {
    const Rgb<Expr> left = named("medium", medium(brdf, Expr::input("side"), Expr::input("path_length")));
    for (Closure<Expr>& c : *sum) c.weight = c.weight * left;
  }
  return sum;
}

ClosureSum<Expr> with_mirror(const Model& model, const Brdf<Expr>& brdf, ClosureSum<Expr> sum) {
  if (model.has_mirror()) sum.emplace_back(ClosureKind::Reflection, brdf.mirror(recorded_wo(model, brdf)));
  return sum;
}

/// What the closures of a fit vary by: inputs, but for what is fixed.
fit::Varied<Expr> recorded_varied(const Model& model, const fit::Fit& fit, const ParamValues& fixed) {
  fit::Varied<Expr> out;
  if (fit.axis()) out.number = Expr::input(fit.axis()->parameter);
  for (const std::string& name : fit.terms().parameters) {
    const auto it = fixed.find(name);
    if (it == fixed.end()) {
      const bool grey = model.info().param(name)->kind == ParamKind::Number;
      out.parameters[name] = grey ? Rgb<Expr>(Expr::input(name)) : Rgb<Expr>::input(name);
    } else {
      const Rgb<double> c = fit::as_rgb(it->second);
      out.parameters[name] = {c.r, c.g, c.b};
    }
  }
  return out;
}

Division division_of(const fit::Fit& fit) {
  return fit.terms().parameters.empty() ? Division::ByLargest : Division::ByChannel;
}

ClosureSum<Expr> recorded_fit(const Model& model, const Brdf<Expr>& brdf, const fit::Fit& fit,
                              const ParamValues& fixed) {
  const fit::Varied<Expr> varied = recorded_varied(model, fit, fixed);
  return with_mirror(model, brdf, fit.closures(recorded_wo(model, brdf), varied, Expr(1), false));
}

std::string ramp_entry(std::size_t closure, std::size_t i) { return fmt::format("ramp_{}[{}]", closure, i); }

void output_closures(const ClosureSum<Expr>& sum, Program& program, std::vector<RecordedClosure>& recorded,
                     Division division = Division::Done) {
  for (std::size_t c = 0; c < sum.size(); ++c) {
    recorded.push_back(
        {sum[c].kind, sum[c].turned, sum[c].stretched, has_ramp(sum[c].kind) ? division : Division::Done});
    program.output(fmt::format("weight_{}", c), sum[c].weight);
    if (has_ramp(sum[c].kind))
      for (std::size_t i = 0; i < kRampSize; ++i) program.output(ramp_entry(c, i), sum[c].ramp[i]);
    if (sum[c].kind == ClosureKind::PhongRamp) program.output(fmt::format("exponent_{}", c), sum[c].exponent);
    if (has_facets(sum[c].kind)) program.output(fmt::format("alpha_{}", c), sum[c].alpha);
    if (sum[c].stretched != Tangent::None) program.output(fmt::format("alpha_across_{}", c), sum[c].alpha_across);
    if (sum[c].stretched == Tangent::Surface) program.output(fmt::format("tangent_{}", c), sum[c].tangent);
    if (sum[c].turned) program.output(fmt::format("normal_{}", c), sum[c].normal);
    if (sum[c].kind == ClosureKind::Refraction) program.output(fmt::format("ior_{}", c), sum[c].ior);
  }
}

Vec3<Expr> recorded_u() { return {Expr::input("u_0"), Expr::input("u_1"), Expr::input("u_2")}; }

void output_sampled(const Model& model, const Brdf<Expr>& brdf, Program& program) {
  const Vec3<Expr> wo = recorded_wo(model, brdf);
  Sample<Expr> s = brdf.sample(wo, recorded_u());
  if (brdf.scatters_through()) s.wi.z = s.wi.z * Expr::input("side");
  program.output("wi", s.wi);
  program.output("weight", s.weight);
}

Recording finish(const Program& program, int indent, const std::vector<std::string>& taken,
                 std::vector<RecordedClosure> closures = {}) {
  Recording r{"", std::move(closures), program.operations(), program.inputs(), {}};
  r.statements = print::osl_program(program, indent, taken, &r.arrays);
  return r;
}

Recording finish(const Model& model, const Program& program, int indent, std::vector<RecordedClosure> closures = {}) {
  return finish(program, indent, parameter_names(model), std::move(closures));
}

/// An OSL vector.
Vec3<Expr> input_vector(const std::string& name) {
  return {Expr::input(name + "[0]"), Expr::input(name + "[1]"), Expr::input(name + "[2]")};
}

/// Closures whose numbers are the variables that output_closures() assigned.
ClosureSum<Expr> input_closures(ClosureSum<Expr> sum) {
  for (std::size_t c = 0; c < sum.size(); ++c) {
    sum[c].weight = Rgb<Expr>::input(fmt::format("weight_{}", c));
    if (has_ramp(sum[c].kind))
      for (std::size_t i = 0; i < kRampSize; ++i) sum[c].ramp[i] = Rgb<Expr>::input(ramp_entry(c, i));
    if (sum[c].kind == ClosureKind::PhongRamp) sum[c].exponent = Expr::input(fmt::format("exponent_{}", c));
    if (has_facets(sum[c].kind)) sum[c].alpha = Expr::input(fmt::format("alpha_{}", c));
    if (sum[c].stretched != Tangent::None) sum[c].alpha_across = Expr::input(fmt::format("alpha_across_{}", c));
    if (sum[c].stretched == Tangent::Surface) sum[c].tangent = input3(fmt::format("tangent_{}", c));
    if (sum[c].turned) sum[c].normal = input3(fmt::format("normal_{}", c));
  }
  return sum;
}

/// The base of an aimed form; none for what lies on both sides of the surface.
ClosureSum<Expr> recorded_base(const Model& model, const Brdf<Expr>& brdf, const fit::Fit* fit,
                               const ParamValues& fixed) {
  const Vec3<Expr> wo = recorded_wo(model, brdf);
  if (fit) return fit->closures(wo, recorded_varied(model, *fit, fixed), Expr(1), false);
  return measure::two_sided(model, brdf) ? ClosureSum<Expr>() : brdf.base(wo);
}

Inputs<float> float_inputs(const ParamValues& values, const Vec3<double>& wo) {
  Inputs<float> inputs;
  set_inputs(inputs, values);
  set_input(inputs, "wo", Vec3<double>{wo.x, wo.y, std::abs(wo.z)});
  set_input(inputs, "side", wo.z > 0 ? 1 : -1);
  return inputs;
}

void require_finite(const Model& model, const ParamValues& values, const Vec3<double>& wo, const std::string& what,
                    const std::array<float, 3>& v, bool may_be_negative) {
  for (float x : v)
    if (!std::isfinite(x) || (!may_be_negative && x < 0))
      throw ValueError(fmt::format("{}: {} = {} at {}, wo = ({:.9g}, {:.9g}, {:.9g})", model.info().name, what, x,
                                   format_values(model.info(), values), wo.x, wo.y, wo.z));
}

/// Fits are in double precision; what single precision adds is rounding.
RepresentationError fitted_error(const std::vector<fit::ViewError>& errors, const std::string& what,
                                 const std::optional<fit::FitAxis>& axis = {}) {
  RepresentationError out;
  double sum1 = 0, sum2 = 0;
  fit::ViewError worst;
  for (const fit::ViewError& e : errors) {
    sum1 += e.relative_l1 / double(errors.size());
    sum2 += e.relative_l2 / double(errors.size());
    out.albedo = std::max(out.albedo, e.albedo);
    if (e.relative_l1 > worst.relative_l1) worst = e;
  }
  out.relative_l1 = sum1;
  out.relative_l2 = sum2;
  out.note = fmt::format("{} fitted to the model, at worst {:.2g} of the light off, seen at a cosine of {:.2g}{}", what,
                         worst.relative_l1, worst.cos_theta_o,
                         axis ? fmt::format(", with {} = {:.3g}", axis->parameter, worst.number) : "");
  return out;
}

/// Where more than the declared number is open, that one alone stays so.
ParamValues fit_values(const Model& model, const ParamValues& fixed) {
  const ModelInfo& info = model.info();
  const ParamValues defaults = complete(info, {});
  ParamValues known = fixed;
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Choice) known.insert(*defaults.find(p.name));
  for (const std::string& name : fit::roles_of(model, known).with(fit::Role::Open))
    if (name != info.properties.fit_axis) known.insert(*defaults.find(name));
  for (const auto& [name, value] : fixed) known.erase(name);
  return known;
}

}  // namespace

const char* name_of(RepresentationKind kind) {
  switch (kind) {
    case RepresentationKind::Exact:
      return "exact";
    case RepresentationKind::Aimed:
      return "aimed";
    case RepresentationKind::Sampled:
      return "sampled";
    case RepresentationKind::Fitted:
      return "fitted";
    case RepresentationKind::Twin:
      return "twin";
  }
  throw std::logic_error("a form without a name");
}

RepresentationKind representation_named(const std::string& name) {
  for (RepresentationKind kind : {RepresentationKind::Exact, RepresentationKind::Aimed, RepresentationKind::Sampled,
                                  RepresentationKind::Fitted, RepresentationKind::Twin})
    if (name == name_of(kind)) return kind;
  input_error("unknown representation '{}': expected one of exact, aimed, sampled, fitted, twin", name);
}

std::vector<RepresentationKind> representations(const Model& model) {
  if (!model.has_scatter()) return {RepresentationKind::Exact};
  std::vector<RepresentationKind> kinds = {RepresentationKind::Sampled};
  // An exact form for all choices leaves nothing to aim.
  const bool exact = model.has_exact();
  if (!exact || !form_values(model, RepresentationKind::Exact).empty())
    kinds.insert(kinds.begin(), RepresentationKind::Aimed);
  if (exact) kinds.insert(kinds.begin(), RepresentationKind::Exact);
  if (!model.info().properties.fit_axis.empty()) kinds.push_back(RepresentationKind::Fitted);
  return kinds;
}

ParamValues form_values(const Model& model, RepresentationKind kind, const ParamValues& fixed) {
  if (is_fit(kind)) return fit_values(model, fixed);
  if (kind != RepresentationKind::Exact) return {};
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

Recording record(const Model& model, RepresentationKind kind, const ParamValues& fixed, int indent,
                 const Cosines& views) {
  if (kind == RepresentationKind::Twin) throw std::logic_error("a twin has no shader");
  Recorder recorder;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  Program program;
  std::vector<RecordedClosure> closures;
  if (kind == RepresentationKind::Exact) {
    const auto sum = recorded_exact(model, *brdf);
    if (!sum) input_error("{}: has no exact representation", model.info().name);
    output_closures(*sum, program, closures);
  } else if (kind == RepresentationKind::Fitted) {
    const fit::Fit fit = fit::fit_of(model, fixed, views);
    output_closures(recorded_fit(model, *brdf, fit, fixed), program, closures, division_of(fit));
  } else {
    output_sampled(model, *brdf, program);
  }
  int used = 0;
  for (const RecordedClosure& c : closures) used += slots(c.kind);
  if (used > kMaxClosures)
    input_error("{}: the {} form needs {} closure slots, and Cycles keeps {}", model.info().name, name_of(kind), used,
                kMaxClosures);
  return finish(model, program, indent, std::move(closures));
}

AimedRecording record_aimed(const Model& model, const ParamValues& fixed, int indent, AimedBase from,
                            const Cosines& views) {
  Recorder recorder;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  const Vec3<Expr> wo = recorded_wo(model, *brdf);
  // The side that a model of two sides calls z > 0.
  const auto turned = [&](Vec3<Expr> w) {
    if (measure::two_sided(model, *brdf)) w.z = w.z * Expr::input("side");
    return w;
  };
  AimedRecording out;
  std::optional<fit::Fit> fit;
  if (from == AimedBase::Fitted) fit = fit::fit_of(model, fixed, views);
  const ClosureSum<Expr> base = recorded_base(model, *brdf, fit ? &*fit : nullptr, fixed);
  {
    Program program;
    std::vector<RecordedClosure> closures;
    output_closures(base, program, closures, fit ? division_of(*fit) : Division::Done);
    out.base = finish(model, program, indent, closures);
  }
  {
    Program program;
    program.output("drawn", turned(draw(*brdf, !base.empty(), wo, recorded_u())));
    out.draw = finish(model, program, indent);
  }
  {
    Program program;
    const Vec3<Expr> wi = input3("wi");
    Rgb<Expr> given(Expr(0));
    // Closures are on the viewer's side, where the model's frame is the shader's.
    for (const Closure<Expr>& c : input_closures(base)) given += evaluate(c, wi, wo);
    const Excess<Expr> e = excess(*brdf, !base.empty(), given, turned(wi), wo);
    program.output("excess", e.value);
    program.output("drawn_density", e.density);
    out.value = finish(model, program, indent);
  }
  return out;
}

const AimedSteps& aimed_steps(int indent) {
  static std::mutex mutex;
  static std::map<int, AimedSteps> made;
  const std::lock_guard lock(mutex);
  if (const auto it = made.find(indent); it != made.end()) return it->second;
  Recorder recorder;
  AimedSteps steps;
  const auto record_step = [&](const auto& outputs) {
    Program program;
    outputs(program);
    return finish(program, indent, {});
  };
  const auto kept_lobe = [](const std::string& index) {
    const auto of = [&](const char* what) { return fmt::format("lobe_{}[{}]", what, index); };
    AimedLobe<Expr> lobe;
    lobe.towards = input_vector(of("towards"));
    lobe.half = input_vector(of("half"));
    lobe.exponent = Expr::input(of("exponent"));
    lobe.sinRadius = Expr::input(of("radius"));
    lobe.cosEnd = Expr::input(of("end"));
    lobe.extent = Expr::input(of("extent"));
    return lobe;
  };
  const auto kept_patch = [](const std::string& index) {
    const auto of = [&](const char* what) { return fmt::format("lamp_{}[{}]", what, index); };
    return LampPatch<Expr>{input_vector(of("centre")), input_vector(of("across")), input_vector(of("along")),
                           Expr::input(of("disk"))};
  };
  const AimedLobe<Expr> earlier = kept_lobe("earlier");
  const LampPatch<Expr> patch = kept_patch("lobes");
  const Expr lobes = Expr::input("lobes");
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
    p.output("lobe_exponent[lobes]", lamp.lobe.exponent);
    p.output("lobe_radius[lobes]", lamp.lobe.sinRadius);
    p.output("lobe_end[lobes]", lamp.lobe.cosEnd);
    p.output("lobe_extent[lobes]", lamp.lobe.extent);
    p.output("lobe_height", lamp.height);
    p.output("lamp_emphasis", lamp.emphasis);
    p.output("lamp_solid_angle[lobes]", lamp.solid_angle);
  });
  const Rgb<Expr> value = Rgb<Expr>::input("excess");
  const Expr density = Expr::input("drawn_density");
  steps.less = record_step([&](Program& p) {
    p.output("excess", value - Rgb<Expr>::input("lobe_value[earlier]") * evaluate(earlier, input3("wi")));
  });
  steps.send = record_step([&](Program& p) {
    AimedLamp<Expr> lamp;
    lamp.height = Expr::input("lobe_height");
    lamp.lobe.extent = Expr::input("lobe_extent[lobes]");
    lamp.emphasis = Expr::input("lamp_emphasis");
    lamp.solid_angle = Expr::input("lamp_solid_angle[lobes]");
    const Sent<Expr> sent = send(lamp, value, density);
    p.output("lobe_value[lobes]", sent.value);
    p.output("lobe_weight[lobes]", sent.weight);
    p.output("lobe_colour[lobes]", sent.colour);
  });
  steps.toss = record_step([&](Program& p) {
    const Toss<Expr> tossed = toss(Expr::input("u_0"), lobes);
    p.output("tossed", tossed.lobe);
    p.output("u_0", tossed.u);
  });
  steps.under = record_step([&](Program& p) {
    p.output("drawn", sample_under(kept_lobe("chosen"), Expr::input("u_1"), Expr::input("u_2")));
  });
  const Met<Expr> before{Rgb<Expr>::input("covered"), Rgb<Expr>::input("covered_before"), Expr::input("lamp_met"),
                         Expr::input("density_under")};
  steps.meet = record_step([&](Program& p) {
    const LampPatch<Expr> of_earlier = kept_patch("earlier");
    const Met<Expr> met = meet(before, of_earlier, earlier, Expr::input("lamp_solid_angle[earlier]"),
                               Rgb<Expr>::input("lobe_value[earlier]"), input3("drawn"));
    p.output("covered_before", met.before);  // from what was covered before this one is added
    p.output("covered", met.covered);
    p.output("lamp_met", met.solid_angle);
    p.output("density_under", met.density);
    p.output("ray", beside(of_earlier, input3("ray")));
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
  return made.emplace(indent, std::move(steps)).first->second;
}

Recording record_mirror(const Model& model, const ParamValues& fixed, int indent) {
  Recorder recorder;
  Program program;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  program.output("mirror_weight", brdf->mirror(recorded_wo(model, *brdf)));
  return finish(model, program, indent, {{ClosureKind::Reflection, false, Tangent::None, Division::Done}});
}

RepresentationError measure_error(const Model& model, RepresentationKind kind, const ParamValues& fixed,
                                  const Cosines& views) {
  if (kind == RepresentationKind::Fitted) {
    const fit::Fit fit = fit::fit_of(model, fixed, views);
    return fitted_error(fit.errors(), "closures", fit.axis());
  }
  if (kind == RepresentationKind::Twin) return fitted_error(fit::twin_of(model, fixed).errors(), "Blender's nodes");
  constexpr int kParameterSets = 4, kViews = 6, kPoints = 256;
  measure::Random random(20260101);
  double difference = 0, total = 0, squared_difference = 0, squared_total = 0, albedo_error = 0;
  const ParamValues confined = form_values(model, kind);
  for (const Choices& choices : choice_combinations(model.info())) {
    if (!admits(model.info(), choices, confined)) continue;
    // The recording does not depend on the values, so one serves all parameter sets.
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> recorded = model.record(with_choices(model.info(), choices));
    Program program;
    std::vector<RecordedClosure> kinds;
    if (kind == RepresentationKind::Exact)
      output_closures(*recorded_exact(model, *recorded), program, kinds);
    else
      output_sampled(model, *recorded, program);

    for (int view = 0; view < kParameterSets * kViews; ++view) {
      const ParamValues values = measure::random_values(model.info(), with_choices(model.info(), choices), random);
      const measure::BoundModel truth = measure::bind_model(model, values);
      Vec3<double> wo = direction(0.02 + 0.98 * (view % kViews + measure::uniform(random)) / kViews,
                                  2 * kPi * measure::uniform(random));
      if (measure::two_sided(model, *truth.brdf) && view % 2 == 1) wo.z = -wo.z;
      Inputs<float> inputs = float_inputs(values, wo);
      const double distance = model.has_medium() ? 3 * measure::uniform(random) : 0;
      set_input(inputs, "path_length", distance);
      const auto executed = [&](const std::map<std::string, std::array<float, 3>>& out, const std::string& name,
                                bool may_be_negative) {
        const auto& v = out.at(name);
        require_finite(model, values, wo, name, v, may_be_negative);
        return Rgb<double>(v[0], v[1], v[2]);
      };
      ClosureSum<double> closures;
      if (kind == RepresentationKind::Exact) {
        const auto out = program.run<float>(inputs);
        for (std::size_t c = 0; c < kinds.size(); ++c) {
          Closure<double> closure(kinds[c].kind, executed(out, fmt::format("weight_{}", c), false));
          if (has_ramp(kinds[c].kind))
            for (std::size_t i = 0; i < kRampSize; ++i) closure.ramp[i] = executed(out, ramp_entry(c, i), true);
          if (kinds[c].kind == ClosureKind::PhongRamp)
            closure.exponent = executed(out, fmt::format("exponent_{}", c), false).r;
          closures.push_back(closure);
        }
      }
      Rgb<double> albedo_difference(0.0);
      if (kind == RepresentationKind::Exact) {
        for (const Closure<double>& c : closures)
          if (c.kind == ClosureKind::Reflection || c.kind == ClosureKind::Refraction) albedo_difference += c.weight;
        albedo_difference = albedo_difference -
                            (truth.brdf->mirror(wo) + truth.brdf->transmit(wo)) * medium(*truth.brdf, wo.z, distance);
      }
      Sequence3 points(std::uint64_t(view) + 1);
      for (int i = 0; i < kPoints; ++i) {
        const Vec3<double> u = points.next();
        if (kind == RepresentationKind::Exact) {
          const Vec3<double> wi = sample_cosine(u.x, u.y);
          const Rgb<double> f_cos = truth.brdf->eval(wi, wo) * wi.z;
          const Rgb<double> d = evaluate(closures, wi, wo) - f_cos;
          difference += std::abs(d.r) + std::abs(d.g) + std::abs(d.b);
          total += f_cos.r + f_cos.g + f_cos.b;
          squared_difference += sqr(d.r) + sqr(d.g) + sqr(d.b);
          squared_total += sqr(f_cos.r) + sqr(f_cos.g) + sqr(f_cos.b);
          albedo_difference += d * (kPi / wi.z / kPoints);
        } else {
          // The same numbers drive both, so that what differs is the arithmetic and not the noise.
          const Vec3<float> v = Vec3<float>::from(u);
          set_input(inputs, "u_0", v.x);
          set_input(inputs, "u_1", v.y);
          set_input(inputs, "u_2", v.z);
          const auto out = program.run<float>(inputs);
          for (const char* axis : {"wi_x", "wi_y", "wi_z"}) executed(out, axis, true);
          albedo_difference +=
              (executed(out, "weight", false) - truth.brdf->sample(wo, Vec3<double>::from(v)).weight) / double(kPoints);
        }
      }
      albedo_error = std::max(
          {albedo_error, std::abs(albedo_difference.r), std::abs(albedo_difference.g), std::abs(albedo_difference.b)});
    }
  }
  if (kind == RepresentationKind::Exact)
    return {total > 0 ? difference / total : 0, squared_total > 0 ? std::sqrt(squared_difference / squared_total) : 0,
            albedo_error, "closures equal the model; what is left is rounding"};
  return {std::nullopt, std::nullopt, albedo_error, "equals the model in expectation, with the noise of sampling it"};
}

}  // namespace brdfc::forms
