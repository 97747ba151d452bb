// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc closure: evaluates our definition of a Cycles closure, for the tests that compare Cycles with it.
#include "app/commands.h"
#include "app/f_cos.h"
#include "closures/lobe.h"
#include "model/model.h"

namespace brdfc::app {
namespace {

ParamInfo parameter(std::string name, double min, double max, std::array<double, 3> value, ParamKind kind) {
  ParamInfo p;
  p.name = std::move(name);
  p.min = min;
  p.max = max;
  p.value = value;
  p.kind = kind;
  return p;
}

/// A schema, for the same checks and messages as for a model's parameters.
ModelInfo schema(const std::string& kind) {
  ModelInfo info;
  info.name = "closure " + kind;
  info.params = {parameter("weight", 0, 1e6, {1, 1, 1}, ParamKind::Color),
                 parameter("normal", -1, 1, {0, 0, 1}, ParamKind::Color),
                 parameter("tangent", -1, 1, {1, 0, 0}, ParamKind::Color),
                 parameter("exponent", 0, 1e8, {1, 0, 0}, ParamKind::Number),
                 parameter("alpha_x", 1e-4, 1, {0.5, 0, 0}, ParamKind::Number),
                 parameter("alpha_y", 1e-4, 1, {0.5, 0, 0}, ParamKind::Number),
                 parameter("roughness", 0, 1, {0, 0, 0}, ParamKind::Number),
                 parameter("albedo", 0, 1, {0, 0, 0}, ParamKind::Color),
                 parameter("size", 1e-5, 1, {0.5, 0, 0}, ParamKind::Number),
                 parameter("smooth", 0, 1, {0, 0, 0}, ParamKind::Number)};
  for (int i = 0; i < kRampSize; ++i)
    info.params.push_back(parameter(fmt::format("ramp_{}", i), -1e6, 1e6, {1, 1, 1}, ParamKind::Color));
  return info;
}

Lobe lobe(LobeKind kind, const ParamValues& v) {
  const auto number = [&](const std::string& name) { return std::get<double>(v.at(name)); };
  const auto color = [&](const std::string& name) {
    const auto& c = std::get<std::array<double, 3>>(v.at(name));
    return Rgb<double>(c[0], c[1], c[2]);
  };
  const auto unit = [&](const std::string& name) {
    const Rgb<double> c = color(name);
    const Vec3<double> w = {c.r, c.g, c.b};
    const double len = length(w);
    if (!(len > 1e-6)) input_error("closure {}: {}: expected a vector that is not 0", name_of(kind), name);
    return w / len;
  };
  Lobe c;
  c.kind = kind;
  c.weight = color("weight");
  c.normal = unit("normal");
  c.tangent = unit("tangent");
  c.exponent = number("exponent");
  c.alpha_x = number("alpha_x");
  c.alpha_y = number("alpha_y");
  c.roughness = number("roughness");
  c.albedo = color("albedo");
  c.size = number("size");
  c.smooth = number("smooth");
  for (int i = 0; i < kRampSize; ++i) c.ramp[std::size_t(i)] = color(fmt::format("ramp_{}", i));
  return c;
}

}  // namespace

void add_closure_command(Command app) {
  struct Options {
    std::string kind;
    std::vector<std::string> values;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "closure",
      "f cos(theta_i) of a Cycles closure, as the forms assume it, for pairs of directions.\n"
      "Kinds: diffuse, burley, oren_nayar, velvet, diffuse_ramp, phong_ramp, reflection, ggx, beckmann,\n"
      "ashikhmin_shirley, diffuse_toon, glossy_toon. Values: weight, normal, tangent, exponent, alpha_x, alpha_y,\n"
      "roughness, albedo, size, smooth, ramp_0 ... ramp_7.\n"
      "stdin:  CSV with header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z (unit vectors above the surface)\n"
      "stdout: CSV with header f_cos_r,f_cos_g,f_cos_b");
  cmd.add_option("kind", o->kind, "Which closure").required();
  cmd.add_option("values", o->values, "name=value; a colour or vector is three numbers or one");
  cmd.callback([o] {
    const LobeKind kind = lobe_named(o->kind);
    const ModelInfo info = schema(o->kind);
    const Lobe c = lobe(kind, complete(info, parse_values(info, o->values)));
    print_f_cos([&](const Vec3<double>& wi, const Vec3<double>& wo) { return evaluate(c, wi, wo); });
  });
}

}  // namespace brdfc::app
