// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/whole.h"

#include <fmt/format.h>

#include "model/under.h"
#include "print/statement.h"

namespace brdfc::forms {

using print::call;
using print::declare;
using print::Value;

void add_whole(ShaderBody& body) {
  const Model& model = body.model;
  if (!has_whole(model)) return;
  const auto name = [](const char* what, std::size_t i) { return fmt::format("whole_{}_{}", what, i); };
  struct Facets {
    ClosureKind kind;
    bool metal;
  };
  std::vector<Facets> closures;
  ChoiceSwitch by_choice(model.info(), body.setting.fixed);
  body.record(by_choice, [&](const Choices&, const ParamValues& values) {
    Recorder recorder;
    Program program;
    program.output("whole", under(model)->record_whole(model.info(), values));
    closures.clear();
    for (const Closure<Expr>& c : under(model)->record(model.info(), values, input3("wo"))) {
      const std::size_t i = closures.size();
      if (!has_facets(c.kind)) throw std::logic_error("closures that equal a model: only facets are known");
      program.output(name("weight", i), c.weight);
      if (c.metal) program.output(name("f0", i), c.f0);
      program.output(name("alpha", i), c.alpha);
      program.output(name("across", i), c.alpha_across);
      closures.push_back({c.kind, c.metal});
    }
    return recording_of(model, std::move(program));
  });
  body.of_whole.push_back(declare("float", "whole"));
  std::vector<Value> sum;
  for (std::size_t i = 0; i < closures.size(); ++i) {
    body.of_whole.push_back(print::declare_all("float", {name("alpha", i), name("across", i)}));
    body.of_whole.push_back(declare("color", name("weight", i)));
    if (closures[i].metal) body.of_whole.push_back(declare("color", name("f0", i)));
    const Value white = call("color", {1.0}), black = call("color", {0.0});
    const Value distribution = print::quotation(closures[i].kind == ClosureKind::Ggx ? "ggx" : "beckmann");
    const Value alpha = name("alpha", i), across = name("across", i);
    // With colours as weights, not numbers, which OSL would store apart from the closures.
    sum.push_back(Value(name("weight", i)) *
                  (closures[i].metal
                       ? call("generalized_schlick_bsdf", {"frame_n", "frame_t", white, black, alpha, across,
                                                           name("f0", i), white, 5.0, distribution})
                       : call("microfacet", {distribution, "frame_n", "frame_t", alpha, across, 1.0, 0})));
  }
  print::append(body.of_whole, print::scope(by_choice.statements()));
  body.whole = print::balanced_sum(sum);
}

}  // namespace brdfc::forms
