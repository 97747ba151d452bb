// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/sequence.h"
#include "forms/recording.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "model/choices.h"
#include "model/inputs.h"
#include "model/sampling.h"

namespace brdfc::forms {
namespace {

constexpr int kParameterSets = 4, kViews = 6, kPoints = 256;

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

/// A model with random parameters, a view, and what was recorded for it.
struct Case {
  const Model& model;
  const ParamValues& values;
  const Brdf<double>& truth;
  const Program& program;
  Inputs<float> inputs;
  Vec3<double> wo;
  double distance;  ///< length of the path in the medium

  std::map<std::string, std::array<float, 3>> run() const { return program.run<float>(inputs); }
  Rgb<double> checked(const std::map<std::string, std::array<float, 3>>& out, const std::string& name,
                      bool may_be_negative) const {
    const auto& v = out.at(name);
    require_finite(model, values, wo, name, v, may_be_negative);
    return Rgb<double>(v[0], v[1], v[2]);
  }
};

/// The largest absolute value that `difference` returns, over all cases and channels.
double largest_difference(const Model& model, const ParamValues& confined,
                          const std::function<void(const Brdf<Expr>&, Program&)>& record,
                          const std::function<Rgb<double>(Case&, Sequence3& points)>& difference) {
  measure::Random random(20260101);
  double largest = 0;
  for (const Choices& choices : choice_combinations(model.info())) {
    if (!admits(model.info(), choices, confined)) continue;
    // The recording does not depend on the values, so one serves all parameter sets.
    Recorder recorder;
    const std::unique_ptr<Brdf<Expr>> recorded = model.record(with_choices(model.info(), choices));
    Program program;
    record(*recorded, program);
    for (int view = 0; view < kParameterSets * kViews; ++view) {
      const ParamValues values = measure::random_values(model.info(), with_choices(model.info(), choices), random);
      const measure::BoundModel truth = measure::bind_model(model, values);
      Vec3<double> wo = direction(0.02 + 0.98 * (view % kViews + measure::uniform(random)) / kViews,
                                  2 * kPi * measure::uniform(random));
      if (measure::two_sided(model, *truth.brdf) && view % 2 == 1) wo.z = -wo.z;
      const double distance = model.has_medium() ? 3 * measure::uniform(random) : 0;
      Case at{model, values, *truth.brdf, program, float_inputs(values, wo), wo, distance};
      set_input(at.inputs, "path_length", distance);
      Sequence3 points(std::uint64_t(view) + 1);
      largest = std::max(largest, max_component(magnitude(difference(at, points))));
    }
  }
  return largest;
}

}  // namespace

FormError error_of_closures(const Model& model, const ParamValues& confined, const RecordClosures& closures_of,
                            const std::string& note) {
  double off = 0, total = 0, squared_off = 0, squared_total = 0;
  std::vector<RecordedClosure> kinds;
  const auto record = [&](const Brdf<Expr>& brdf, Program& program) {
    kinds = output_closures(closures_of(brdf), program);
    for (const RecordedClosure& c : kinds)
      if (has_facets(c.kind) || c.turned)
        throw std::logic_error(model.info().name + ": the error of facets or closures with normals is not executed");
  };
  const double albedo = largest_difference(model, confined, record, [&](Case& at, Sequence3& points) {
    const auto out = at.run();
    ClosureSum<double> closures;
    for (std::size_t c = 0; c < kinds.size(); ++c) {
      Closure<double> closure(kinds[c].kind, at.checked(out, fmt::format("weight_{}", c), false));
      if (has_ramp(kinds[c].kind))
        for (std::size_t i = 0; i < kRampSize; ++i) closure.ramp[i] = at.checked(out, ramp_entry(c, i), true);
      if (kinds[c].kind == ClosureKind::PhongRamp)
        closure.exponent = at.checked(out, fmt::format("exponent_{}", c), false).r;
      if (has_matte_roughness(kinds[c].kind))
        closure.roughness = at.checked(out, fmt::format("roughness_{}", c), false).r;
      if (kinds[c].kind == ClosureKind::OrenNayar) closure.albedo = at.checked(out, fmt::format("albedo_{}", c), false);
      if (has_cone(kinds[c].kind)) {
        closure.size = at.checked(out, fmt::format("size_{}", c), false).r;
        closure.smooth = at.checked(out, fmt::format("smooth_{}", c), false).r;
      }
      closures.push_back(closure);
    }
    Rgb<double> difference(0.0);
    for (const Closure<double>& c : closures)
      if (c.kind == ClosureKind::Reflection || c.kind == ClosureKind::Refraction) difference += c.weight;
    difference =
        difference - (at.truth.mirror(at.wo) + at.truth.transmit(at.wo)) * medium(at.truth, at.wo.z, at.distance);
    for (int i = 0; i < kPoints; ++i) {
      const Vec3<double> u = points.next(), wi = sample_cosine(u.x, u.y);
      const Rgb<double> f_cos = at.truth.eval(wi, at.wo) * wi.z;
      const Rgb<double> d = evaluate(closures, wi, at.wo) - f_cos;
      off += std::abs(d.r) + std::abs(d.g) + std::abs(d.b);
      total += f_cos.r + f_cos.g + f_cos.b;
      squared_off += sqr(d.r) + sqr(d.g) + sqr(d.b);
      squared_total += sqr(f_cos.r) + sqr(f_cos.g) + sqr(f_cos.b);
      difference += d * (kPi / wi.z / kPoints);
    }
    return difference;
  });
  return {total > 0 ? off / total : 0, squared_total > 0 ? std::sqrt(squared_off / squared_total) : 0, albedo, note};
}

FormError error_of_samples(const Model& model) {
  const auto record = [&](const Brdf<Expr>& brdf, Program& program) { output_sampled(model, brdf, program); };
  const double albedo = largest_difference(model, {}, record, [&](Case& at, Sequence3& points) {
    Rgb<double> difference(0.0);
    for (int i = 0; i < kPoints; ++i) {
      // Both use the same random numbers, so that they differ by arithmetic only and not by noise.
      const Vec3<float> v = Vec3<float>::from(points.next());
      set_input(at.inputs, "u_0", v.x);
      set_input(at.inputs, "u_1", v.y);
      set_input(at.inputs, "u_2", v.z);
      const auto out = at.run();
      for (const char* axis : {"wi_x", "wi_y", "wi_z"}) at.checked(out, axis, true);
      difference +=
          (at.checked(out, "weight", false) - at.truth.sample(at.wo, Vec3<double>::from(v)).weight) / double(kPoints);
    }
    return difference;
  });
  return {std::nullopt, std::nullopt, albedo, "equals the model in expectation, with the noise of sampling it"};
}

}  // namespace brdfc::forms
