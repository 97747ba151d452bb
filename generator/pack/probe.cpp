// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/probe.h"

#include "model/inputs.h"
#include "print/osl_library.h"
#include "print/osl_statements.h"
#include "trace/osl_arithmetic.h"

namespace brdfc::pack {
namespace {

using print::assign;
using print::call;
using print::choice;
using print::declare;
using print::operation;
using print::Statements;
using print::Value;

struct Recorded {
  Program eval, sample;
};

/// Records into the current recorder. Names of the outputs are those of the shader's variables.
Recorded record_both(const Model& model, const ParamValues& choices) {
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(choices);
  const Vec3<Expr> wo = input3("wo");
  Recorded r;
  const Vec3<Expr> wi = input3("wi");
  r.eval.output("shown_f", brdf->eval(wi, wo));
  r.eval.output("shown_pdf", brdf->pdf(wi, wo));
  const Sample<Expr> s = brdf->sample(wo, {Expr::input("u_0"), Expr::input("u_1"), Expr::input("u_2")});
  r.sample.output("shown", s.wi);
  r.sample.output("shown_pdf", s.pdf);
  r.sample.output("shown_weight", s.weight);
  return r;
}

template <class T> ProbeValues direct(const Brdf<T>& brdf, const ProbePoint& p) {
  const auto wi = Vec3<T>::from(p.wi), wo = Vec3<T>::from(p.wo), u = Vec3<T>::from(p.u);
  const Rgb<T> f = brdf.eval(wi, wo);
  const Sample<T> s = brdf.sample(wo, u);
  return {double(f.r),        double(f.g),        double(f.b),    double(brdf.pdf(wi, wo)),
          double(s.wi.x),     double(s.wi.y),     double(s.wi.z), double(s.weight.r),
          double(s.weight.g), double(s.weight.b), double(s.pdf)};
}

ProbeValues executed(const Recorded& r, const ProbePoint& p) {
  Inputs<float> in;
  set_inputs(in, p.values);
  set_input(in, "wi", p.wi);
  set_input(in, "wo", p.wo);
  set_input(in, "u_0", p.u.x);
  set_input(in, "u_1", p.u.y);
  set_input(in, "u_2", p.u.z);
  const auto f = r.eval.run<float>(in), s = r.sample.run<float>(in);
  const auto& rgb = f.at("shown_f");
  const auto& weight = s.at("shown_weight");
  return {
      rgb[0],    rgb[1],    rgb[2],    f.at("shown_pdf")[0], s.at("shown_x")[0], s.at("shown_y")[0], s.at("shown_z")[0],
      weight[0], weight[1], weight[2], s.at("shown_pdf")[0]};
}

}  // namespace

const char* name_of(ProbeRun run) {
  switch (run) {
    case ProbeRun::Double:
      return "double";
    case ProbeRun::Float:
      return "float";
    case ProbeRun::Recorded:
      return "recorded";
    default:
      return "osl";
  }
}

std::string probe_source(const Model& model, const ParamValues& choices) {
  if (!model.has_scatter()) input_error("{}: has delta terms alone, there is nothing to probe", model.info().name);
  Recorder recorder;
  const Recorded r = record_both(model, choices);
  std::vector<std::string> taken;  // parameters, and their names in the node
  for (const ParamInfo& p : model.info().params) taken.insert(taken.end(), {p.name, "p_" + p.name});
  // The values are inputs of the node, because Cycles passes on only attributes that nodes ask for.
  std::string parameters = "    float show = 0,\n    vector wi = 0,\n    vector wo = 0,\n    vector numbers = 0,\n";
  Statements body;
  for (const char* name : {"wi", "wo"})
    for (int i = 0; i < 3; ++i)
      body.push_back(declare("float", fmt::format("{}_{}", name, "xyz"[i]), print::element(name, i)));
  for (int i = 0; i < 3; ++i) body.push_back(declare("float", fmt::format("u_{}", i), print::element("numbers", i)));
  for (const ParamInfo& p : model.info().params) {
    if (p.kind == ParamKind::Choice) continue;
    const char* type = p.kind == ParamKind::Color ? "color" : "float";
    parameters += fmt::format("    {} p_{} = 0,\n", type, p.name);
    body.push_back(declare(type, p.name, "p_" + p.name));
  }
  Statements eval = {declare("color", "shown_f"), declare("float", "shown_pdf")};
  append(eval, print::run_with_arrays(std::make_shared<const Program>(r.eval), taken));
  const Value pdf = call("color", {"shown_pdf"});
  eval.push_back(assign("first", choice(operation("show", ">", 2.5), pdf, "shown_f")));
  Statements sample = {print::declare_all("float", {"shown_x", "shown_y", "shown_z", "shown_pdf"}),
                       declare("color", "shown_weight")};
  append(sample, print::run_with_arrays(std::make_shared<const Program>(r.sample), taken));
  sample.push_back(
      assign("first", choice(operation("show", "<", 1.25), call("color", {"shown_x", "shown_y", "shown_z"}),
                             choice(operation("show", "<", 1.75), pdf, "shown_weight"))));
  const Value channel = print::element("first", "i");
  append(body, {
                   declare("color", "first", 0),
                   print::If{print::any_of({operation("show", "<", 0.5), operation("show", ">", 2.5)}), eval, sample},
                   print::Loop{"i", 3, {print::If{!call("isfinite", {channel}), {assign(channel, -31337.0)}}}},
                   assign("BSDF", Value("first") * call("emission")),
               });
  // In a block of their own, parameters may be called as closures are that Blender's headers declare, such as sheen.
  return "// SPDX-License-Identifier: GPL-3.0-or-later\n" + print::library_for(print::functions_in(body)) +
         "\nshader brdfc_probe(\n" + parameters + "    output closure color BSDF = 0)\n{\n    {\n" +
         print::osl_statements(body, 2).text + "    }\n}\n";
}

std::vector<std::array<ProbeValues, 4>> run_probe(const Model& model, const ParamValues& choices,
                                                  const std::vector<ProbePoint>& points) {
  Recorder recorder;
  const Recorded r = record_both(model, choices);
  std::vector<std::array<ProbeValues, 4>> all;
  for (const ProbePoint& p : points) {
    std::array<ProbeValues, 4> runs;
    runs[0] = direct(*model.make_double(p.values), p);
    runs[1] = direct(*model.make_float(p.values), p);
    runs[2] = executed(r, p);
    const OslArithmetic arithmetic;
    runs[3] = executed(r, p);
    all.push_back(runs);
  }
  return all;
}

}  // namespace brdfc::pack
