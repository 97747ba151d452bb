// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/manifest.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "fit/roles.h"
#include "measure/bound_model.h"
#include "model/choices.h"

namespace brdfc::pack {
namespace {

using forms::RepresentationKind;

/// Whether a clamp shows in a form by how bright its highlight is: in closures that are glossy, and directions drawn
/// beside a base or lobes; not where a mirror shows it before.
bool has_highlight(RepresentationKind kind, bool mirror, const Shader& shader) {
  const bool ramps = shader.slots > shader.closures;
  return !mirror && (kind == RepresentationKind::Twin || kind == RepresentationKind::Aimed ||
                     ((kind == RepresentationKind::Exact || kind == RepresentationKind::Fitted) && ramps));
}

}  // namespace

Json parameter_json(const ParamInfo& p) {
  Json j = {{"name", p.name}, {"label", p.label}};
  switch (p.kind) {
    case ParamKind::Number:
      j["kind"] = "number";
      break;
    case ParamKind::Color:
      j["kind"] = "color";
      break;
    case ParamKind::Choice:
      j["kind"] = "choice";
      break;
  }
  j["unit"] = p.unit;
  if (p.kind == ParamKind::Choice) {
    j["default"] = p.choices[std::size_t(p.value[0])];
    j["choices"] = p.choices;
  } else {
    j["min"] = p.min;
    j["max"] = p.max;
    j["soft_min"] = p.soft_min;
    j["soft_max"] = p.soft_max;
    j["default"] = p.kind == ParamKind::Color ? Json(p.value) : Json(p.value[0]);
  }
  j["doc"] = p.doc;
  return j;
}

Json error_json(const forms::RepresentationError& e) {
  return {{"relative_l1", e.relative_l1 ? Json(*e.relative_l1) : Json()},
          {"relative_l2", e.relative_l2 ? Json(*e.relative_l2) : Json()},
          {"albedo", e.albedo},
          {"note", e.note}};
}

Json values_json(const ParamValues& values) {
  Json j = Json::object();
  for (const auto& [name, value] : values) j[name] = std::visit([](const auto& v) { return Json(v); }, value);
  return j;
}

std::vector<std::string> warnings(RepresentationKind kind, bool mirror, const Shader& shader) {
  // Measured in Cycles (script/conditions): bump-map correction turns closures where a normal is bent; a clamp or a
  // lamp of no size meets a sampled lobe differently from Blender's own closures, and its lobes' normals are not the
  // surface's; a clamp darkens lights in a mirror and, by how bright they are, highlights; Filter Glossy blurs mirrors
  // and facets; mirrors and drawn directions do not meet lamps without multiple importance.
  std::vector<std::string> codes = {"bump_correction"};
  if (mirror || kind == RepresentationKind::Sampled || kind == RepresentationKind::Aimed)
    codes.push_back("multiple_importance");
  if (kind == RepresentationKind::Twin) {
    // Blender's own nodes: a matte one, glossy ones whose facets lean, and a mirror.
    codes.insert(codes.end(), {"leaning_facets", "caustics", "filter_glossy"});
    if (mirror) codes.push_back("clamp_mirror");
    return codes;
  }
  if (kind == RepresentationKind::Aimed) {
    // Path Guiding and the passes know nothing of closures that take light away: pictures get 2 % too bright, the
    // albedo too high by what base and rest cancel. Normals are those of the drawn lobes where no base outweighs them.
    codes.insert(codes.end(), {"path_guiding", "orthographic_far", "albedo_passes"});
    if (mirror) codes.push_back("clamp_mirror");
    if (shader.closures - shader.lamps - (mirror ? 1 : 0) == 1) codes.push_back("normal_pass");
  } else if (kind == RepresentationKind::Sampled) {
    codes.insert(codes.end(),
                 {"clamp_indirect", "clamp_direct", "zero_size_lights", "orthographic_far", "normal_pass"});
  } else if (mirror) {
    codes.push_back("clamp_mirror");
  }
  // Cycles drops glossy closures behind a diffuse surface; ramps it does not.
  if (shader.facets) codes.push_back("caustics");
  if (mirror || shader.facets) codes.push_back("filter_glossy");
  if (mirror && kind == RepresentationKind::Sampled) codes.push_back("albedo_passes_mirror");
  // Only ramps take more slots than closures, and in an exact form they are signed: what they take away the passes
  // do not see.
  if (kind == RepresentationKind::Exact && shader.slots > shader.closures) codes.push_back("albedo_passes");
  return codes;
}

Json table_json(const measure::AlbedoTable& t, const std::string& file, const Model& model, const ParamValues& fixed) {
  Json grids = Json::array(), terms = Json::array();
  for (const measure::AlbedoGrid& g : t.grids) {
    Json axes = Json::array();
    for (const measure::TableAxis& a : g.axes)
      axes.push_back({{"name", a.name}, {"scale", name_of(a.scale)}, {"values", a.values}});
    grids.push_back({{"axes", axes}, {"channels", g.channels}, {"error", g.error}, {"values", g.values}});
  }
  const std::vector<Choices> combinations = choice_combinations(model.info());
  for (std::size_t i = 0; i < t.terms.size(); ++i) {
    if (!admits(model.info(), combinations.at(i), fixed)) continue;
    Json list = Json::array();
    for (const measure::AlbedoTerm& term : t.terms[i])
      list.push_back({{"mirror", term.mirror}, {"colors", term.colors}, {"grid", term.grid}});
    terms.push_back(list);
  }
  Json choices = Json::array(), choice_sizes = Json::array();
  for (std::size_t i = 0; i < t.choices.size(); ++i) {
    if (fixed.count(t.choices[i])) continue;
    choices.push_back(t.choices[i]);
    choice_sizes.push_back(t.choice_sizes[i]);
  }
  return {{"table", file},      {"doc", t.doc},
          {"error", t.error},   {"anisotropy", t.anisotropy},
          {"choices", choices}, {"choice_sizes", choice_sizes},
          {"terms", terms},     {"grids", grids}};
}

Json axis_json(const fit::Fit* fit) {
  if (!fit || !fit->axis()) return {};
  return {{"name", fit->axis()->parameter}, {"min", fit->axis()->low}, {"max", fit->axis()->high}};
}

Json highlight_json(const Model& model, RepresentationKind kind, const Shader& shader, const ParamValues& fixed) {
  if (!has_highlight(kind, model.has_mirror(), shader)) return {};
  constexpr int kValues = 9;
  const ModelInfo& info = model.info();
  std::vector<const ParamInfo*> numbers;
  const fit::Roles& roles = fit::roles_of(model, fixed);
  for (const ParamInfo& p : info.params) {
    const fit::Role role = roles.of(p.name);
    if (p.kind == ParamKind::Number && role != fit::Role::Constant && role != fit::Role::Factor) numbers.push_back(&p);
  }
  const auto declared =
      std::ranges::find(numbers, info.properties.fit_axis, [](const ParamInfo* p) { return p->name; });
  const ParamInfo* over = declared != numbers.end() ? *declared : numbers.size() == 1 ? numbers[0] : nullptr;
  Json values = Json::array(), bright = Json::array();
  for (int i = 0; i < (over ? kValues : 1); ++i) {
    ParamValues at = fixed;
    if (over) {
      const double number = over->slider().at(double(i) / (kValues - 1));
      at[over->name] = number;
      values.push_back(number);
    }
    const measure::BoundModel bound = measure::bind_model(model, at);
    double most = 0;
    for (const Vec3<double>& wo : {Vec3<double>{0, 0, 1}, Vec3<double>{std::sqrt(0.5), 0, std::sqrt(0.5)}}) {
      const Rgb<double> f = bound.brdf->eval({-wo.x, -wo.y, wo.z}, wo);
      most = std::max(most, std::max({f.r, f.g, f.b}) * wo.z);
    }
    bright.push_back(most);
  }
  return {{"name", over ? Json(over->name) : Json()}, {"values", values}, {"f_cos", bright}};
}

}  // namespace brdfc::pack
