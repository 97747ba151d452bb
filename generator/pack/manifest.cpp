// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/manifest.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>

#include "fit/roles.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measure/read_parameters.h"
#include "model/choices.h"
#include "trace/program.h"

namespace brdfc::pack {

Json looks_json() {
  Json names = Json::array();
  for (const Look look : {Look::Matte, Look::Glossy, Look::Metal, Look::Glass, Look::Special})
    names.push_back(name_of(look));
  return names;
}

namespace {

/// For each parameter that is unused under some choices: by choice, the options under which a formula reads it.
using Readers = std::map<std::string, std::vector<std::set<int>>>;

Readers readers(const Model& model) {
  const ModelInfo& info = model.info();
  Readers found;
  for (const Choices& choices : choice_combinations(info)) {
    for (const std::string& name : measure::read_parameters(model, with_choices(info, choices))) {
      auto& by_choice = found[name];
      by_choice.resize(choices.size());
      for (std::size_t i = 0; i < choices.size(); ++i) by_choice[i].insert(choices[i]);
    }
  }
  return found;
}

}  // namespace

const char* name_of(ParamKind k) {
  return k == ParamKind::Number ? "number" : k == ParamKind::Color ? "color" : "choice";
}

Json parameter_json(const ParamInfo& p) {
  Json j = {{"name", p.name}, {"label", p.label}, {"kind", name_of(p.kind)}, {"unit", p.unit}};
  if (p.kind == ParamKind::Choice) {
    j["default"] = p.choices[std::size_t(p.value[0])];
    j["choices"] = p.choices;
  } else {
    j["min"] = p.min;
    j["max"] = p.max;
    j["soft_min"] = p.soft_min;
    j["soft_max"] = p.soft_max;
    j["default"] = p.kind == ParamKind::Color ? Json(p.value) : Json(p.value[0]);
    if (p.kind == ParamKind::Number) {
      j["by_factors"] = p.by_factors;
      j["scale"] = name_of(p.slider().scale);
    }
  }
  j["doc"] = p.doc;
  if (p.optical != Optical::None) j["optical"] = name_of(p.optical);
  if (!p.panel.empty()) j["panel"] = p.panel;
  return j;
}

Json parameters_json(const Model& model, const ParamValues& fixed) {
  Json list = Json::array();
  const Readers found = readers(model);
  for (const ParamInfo& p : model.info().params) {
    if (fixed.count(p.name)) continue;
    Json j = parameter_json(p), needs = Json::object();
    if (const auto reader = found.find(p.name); reader != found.end()) {
      std::size_t k = 0;
      for (const ParamInfo& choice : model.info().params) {
        if (choice.kind != ParamKind::Choice) continue;
        const std::set<int>& under = reader->second[k++];
        if (under.size() == choice.choices.size()) continue;
        for (const int i : under) needs[choice.name].push_back(choice.choices[std::size_t(i)]);
      }
    }
    if (!needs.empty()) j["needs"] = needs;
    list.push_back(j);
  }
  return list;
}

Json values_json(const ParamValues& values) {
  Json j = Json::object();
  for (const auto& [name, value] : values) j[name] = std::visit([](const auto& v) { return Json(v); }, value);
  return j;
}

Json error_json(const forms::FormError& e) {
  return {{"relative_l1", e.relative_l1 ? Json(*e.relative_l1) : Json()},
          {"relative_l2", e.relative_l2 ? Json(*e.relative_l2) : Json()},
          {"albedo", e.albedo},
          {"note", e.note},
          {"at", values_json(e.at)}};
}

Json optical_json(const Model& model, const ParamValues& values) {
  Json j = Json::object();
  for (const ParamInfo& p : model.info().params)
    if (p.optical != Optical::None && values.count(p.name)) j[p.name] = name_of(p.optical);
  return j;
}

Json through_json(const Model& model) {
  Json out = Json::array();
  const auto passes = [&](const ParamValues& values) {
    return measure::two_sided(model, *model.make_double(complete(model.info(), values)));
  };
  if (passes({})) return {Json::object()};
  for (const ParamInfo& p : model.info().params)
    for (const std::string& choice : p.choices)
      if (passes({{p.name, choice}})) out.push_back({{p.name, choice}});
  return out;
}

Json table_json(const measure::AlbedoTable& t, const std::string& file, const Model& model, const ParamValues& fixed) {
  Json grids = Json::array(), terms = Json::array();
  for (const Table& g : t.grids) {
    Json axes = Json::array();
    for (const TableAxis& a : g.axes)
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

Json axis_json(const std::optional<fit::FitAxis>& axis) {
  if (!axis) return {};
  return {{"name", axis->parameter}, {"min", axis->low}, {"max", axis->high}};
}

Json highlight_json(const Model& model, const forms::Form& form, const forms::Shader& shader,
                    const ParamValues& fixed) {
  if (!form.highlights(model, shader)) return {};
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
