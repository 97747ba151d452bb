// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc list: lists the registered models.
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "core/error.h"
#include "core/json_text.h"
#include "forms/form.h"
#include "model/model.h"
#include "pack/manifest.h"

namespace brdfc::app {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> names_of_forms(const Model& m) {
  std::vector<std::string> names;
  for (const forms::Form* form : forms::forms_of(m)) names.push_back(form->name());
  return names;
}

Json describe(const Model& m) {
  const ModelInfo& info = m.info();
  Json params = Json::array();
  for (const ParamInfo& p : info.params) params.push_back(pack::parameter_json(p));
  const ModelProperties& q = info.properties;
  return {{"name", info.name},
          {"label", info.label},
          {"look", name_of(info.look)},
          {"paper", info.paper},
          {"equations", info.equations},
          {"doc", info.doc},
          {"properties",
           {{"reciprocal", q.reciprocal},
            {"conserving", q.conserving},
            {"lossless", q.lossless},
            {"isotropic", q.isotropic},
            {"positive", q.positive},
            {"smooth", q.smooth},
            {"exact_sampling", q.exact_sampling},
            {"diffuse_limit", q.diffuse_limit},
            {"specular_limit", q.specular_limit},
            {"fit_axis", q.fit_axis}}},
          {"scatter", m.has_scatter()},
          {"mirror", m.has_mirror()},
          {"representations", names_of_forms(m)},
          {"parameters", std::move(params)}};
}

void print_text(const Model& m) {
  const ModelInfo& info = m.info();
  fmt::print("{}  {}\n  {} ({})\n  {}\n", info.name, info.label, info.paper, info.equations, info.doc);
  std::string names;
  for (const forms::Form* form : forms::forms_of(m)) {
    names += (names.empty() ? "" : ", ") + form->name();
    if (const ParamValues only = form->values(m, {}); !only.empty())
      names += fmt::format(" (only {})", format_values(info, only));
  }
  fmt::print("  forms: {}\n", names);
  for (const ParamInfo& p : info.params) {
    std::string range, value;
    if (p.kind == ParamKind::Choice) {
      for (const std::string& c : p.choices) range += (range.empty() ? "" : "|") + c;
      value = p.choices[std::size_t(p.value[0])];
    } else {
      range = fmt::format("{:g}..{:g}{}", p.min, p.max, p.unit.empty() ? "" : " " + p.unit);
      value = p.kind == ParamKind::Color ? fmt::format("{:g},{:g},{:g}", p.value[0], p.value[1], p.value[2])
                                         : fmt::format("{:g}", p.value[0]);
    }
    fmt::print("    {:<12} {:<7} {:<36} default {:<16} {}\n", p.name, pack::name_of(p.kind), range, value, p.doc);
  }
  fmt::print("\n");
}

}  // namespace

void add_list_command(Command app) {
  struct Options {
    std::string model;
    bool json = false;
  };
  auto options = std::make_shared<Options>();
  const Command cmd = app.add_subcommand("list", "The models, their parameters and forms.");
  cmd.add_option("model", options->model, "The name of a model. All models if omitted");
  cmd.add_flag("--json", options->json, "Print JSON: an array of objects");
  cmd.callback([options] {
    const std::vector<const Model*> listed = models_named(options->model);
    if (options->json) {
      Json all = Json::array();
      for (const Model* model : listed) all.push_back(describe(*model));
      fmt::print("{}\n", json_text(all, 2));
    } else {
      for (const Model* model : listed) print_text(*model);
    }
  });
}

}  // namespace brdfc::app
