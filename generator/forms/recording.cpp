// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/recording.h"

#include <fmt/format.h>

#include <utility>

#include "measure/probes.h"
#include "model/horizon.h"
#include "model/inputs.h"

namespace brdfc::forms {
namespace {

/// The parameters of the shader. Its statements may not declare these names, even if they do not read them.
std::vector<std::string> parameter_names(const Model& model) {
  std::vector<std::string> names;
  for (const ParamInfo& p : model.info().params) names.push_back(p.name);
  return names;
}

/// The numbers that a fit's closures depend on: inputs, or constants if they are fixed.
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

}  // namespace

Recording recording_of(Program program, std::vector<std::string> taken, std::vector<RecordedClosure> closures) {
  return {std::make_shared<const Program>(std::move(program)), std::move(closures), std::move(taken)};
}

Recording recording_of(const Model& model, Program program, std::vector<RecordedClosure> closures) {
  return recording_of(std::move(program), parameter_names(model), std::move(closures));
}

Vec3<Expr> turned_to_side(const Model& model, const Brdf<Expr>& brdf, Vec3<Expr> w) {
  if (measure::two_sided(model, brdf)) w.z = w.z * Expr::input("side");
  return w;
}

Vec3<Expr> recorded_wo(const Model& model, const Brdf<Expr>& brdf) {
  return turned_to_side(model, brdf, raise_to_horizon(input3("wo")));
}

Vec3<Expr> recorded_u() { return {Expr::input("u_0"), Expr::input("u_1"), Expr::input("u_2")}; }

std::string ramp_entry(std::size_t closure, std::size_t i) { return fmt::format("ramp_{}[{}]", closure, i); }

std::vector<RecordedClosure> output_closures(const ClosureSum<Expr>& sum, Program& program, Division division) {
  std::vector<RecordedClosure> recorded;
  for (std::size_t c = 0; c < sum.size(); ++c) {
    if (sum[c].metal) throw std::logic_error("facets with a Fresnel term are no part of a sum");
    recorded.push_back(
        {sum[c].kind, sum[c].turned, sum[c].stretched, has_ramp(sum[c].kind) ? division : Division::Done});
    program.output(fmt::format("weight_{}", c), sum[c].weight);
    if (has_ramp(sum[c].kind))
      for (std::size_t i = 0; i < kRampSize; ++i) program.output(ramp_entry(c, i), sum[c].ramp[i]);
    if (sum[c].kind == ClosureKind::PhongRamp) program.output(fmt::format("exponent_{}", c), sum[c].exponent);
    if (has_matte_roughness(sum[c].kind)) program.output(fmt::format("roughness_{}", c), sum[c].roughness);
    if (sum[c].kind == ClosureKind::OrenNayar) program.output(fmt::format("albedo_{}", c), sum[c].albedo);
    if (has_cone(sum[c].kind)) {
      program.output(fmt::format("size_{}", c), sum[c].size);
      program.output(fmt::format("smooth_{}", c), sum[c].smooth);
    }
    if (has_facets(sum[c].kind)) program.output(fmt::format("alpha_{}", c), sum[c].alpha);
    if (sum[c].stretched != Tangent::None) program.output(fmt::format("alpha_across_{}", c), sum[c].alpha_across);
    if (sum[c].stretched == Tangent::Surface) program.output(fmt::format("tangent_{}", c), sum[c].tangent);
    if (sum[c].turned) program.output(fmt::format("normal_{}", c), sum[c].normal);
    if (sum[c].kind == ClosureKind::Refraction) program.output(fmt::format("ior_{}", c), sum[c].ior);
  }
  return recorded;
}

ClosureSum<Expr> input_closures(ClosureSum<Expr> sum) {
  for (std::size_t c = 0; c < sum.size(); ++c) {
    sum[c].weight = Rgb<Expr>::input(fmt::format("weight_{}", c));
    if (has_ramp(sum[c].kind))
      for (std::size_t i = 0; i < kRampSize; ++i) sum[c].ramp[i] = Rgb<Expr>::input(ramp_entry(c, i));
    if (sum[c].kind == ClosureKind::PhongRamp) sum[c].exponent = Expr::input(fmt::format("exponent_{}", c));
    if (has_matte_roughness(sum[c].kind)) sum[c].roughness = Expr::input(fmt::format("roughness_{}", c));
    if (sum[c].kind == ClosureKind::OrenNayar) sum[c].albedo = Rgb<Expr>::input(fmt::format("albedo_{}", c));
    if (has_cone(sum[c].kind)) {
      sum[c].size = Expr::input(fmt::format("size_{}", c));
      sum[c].smooth = Expr::input(fmt::format("smooth_{}", c));
    }
    if (has_facets(sum[c].kind)) sum[c].alpha = Expr::input(fmt::format("alpha_{}", c));
    if (sum[c].stretched != Tangent::None) sum[c].alpha_across = Expr::input(fmt::format("alpha_across_{}", c));
    if (sum[c].stretched == Tangent::Surface) sum[c].tangent = input3(fmt::format("tangent_{}", c));
    if (sum[c].turned) sum[c].normal = input3(fmt::format("normal_{}", c));
  }
  return sum;
}

ClosureSum<Expr> recorded_fit(const Model& model, const fit::Fit& fit, const ParamValues& fixed, const Vec3<Expr>& wo) {
  return fit.closures(wo, recorded_varied(model, fit, fixed), Expr(1), false);
}

Division division_of(const fit::Fit& fit) {
  return fit.terms().parameters.empty() ? Division::ByLargest : Division::ByChannel;
}

void output_sampled(const Model& model, const Brdf<Expr>& brdf, Program& program) {
  const Vec3<Expr> wo = recorded_wo(model, brdf);
  Sample<Expr> s = brdf.sample(wo, recorded_u());
  if (brdf.scatters_through()) s.wi.z = s.wi.z * Expr::input("side");
  program.output("wi", s.wi);
  program.output("weight", s.weight);
}

Recording record_closures(const Model& model, const ParamValues& fixed, const RecordClosures& closures,
                          Division division) {
  Recorder recorder;
  Program program;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  const std::vector<RecordedClosure> recorded = output_closures(closures(*brdf), program, division);
  return recording_of(model, std::move(program), recorded);
}

Recording record_mirror(const Model& model, const ParamValues& fixed) {
  Recorder recorder;
  Program program;
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(fixed);
  program.output("mirror_weight", brdf->mirror(recorded_wo(model, *brdf)));
  return recording_of(model, std::move(program), {{ClosureKind::Reflection, false, Tangent::None, Division::Done}});
}

}  // namespace brdfc::forms
