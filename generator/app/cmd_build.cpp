// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/commands.h"
#include "pack/pack.h"
#include "reference/scene.h"

namespace brdfc {
namespace {

struct Options {
  bool all = false, json = false, twin = false;
  std::optional<double> error;  // percent
  std::string scene, materials, out, addon = BRDFC_SOURCE_DIR "/blender_addon";
  std::vector<std::string> models;
};

void print_table(const PackResult& result) {
  fmt::print("{:<20} {:<8} {:>8} {:>6} {:>10} {:>11} {:>11} {:>12} {:>11} {:>8}\n", "model", "form", "closures",
             "slots", "operations", "relative_l1", "albedo", "table_floats", "table_error", "bytes");
  for (const PackLine& l : result.lines)
    fmt::print("{:<20} {:<8} {:>8} {:>6} {:>10} {:>11} {:>11.2e} {:>12} {:>11.2e} {:>8}\n", l.model, l.representation,
               l.closures, l.slots, l.operations,
               l.error.relative_l1 ? fmt::format("{:.2e}", *l.error.relative_l1) : "expectation", l.error.albedo,
               l.table_floats, l.table_error, l.bytes);
}

/// How materials are used.
std::vector<MaterialNeed> needs_of(const std::vector<Material>& materials) {
  std::vector<MaterialNeed> needs;
  for (const Material& m : materials) {
    MaterialNeed need{m.id, m.model, m.values, m.varying, m.representation, m.lobes};
    for (const auto& [name, image] : m.textures) need.textured.insert(name);
    needs.push_back(std::move(need));
  }
  return needs;
}

nlohmann::ordered_json explanation(const PlannedModel& plan, const PackResult& result) {
  const ModelInfo& info = plan.model->info();
  nlohmann::ordered_json forms = nlohmann::ordered_json::array(), free = nlohmann::ordered_json::array();
  for (const PackLine& l : result.lines)
    if (l.model == info.name)
      forms.push_back({{"form", l.representation},
                       {"before",
                        {{"bytes", l.whole_bytes},
                         {"operations", l.whole_operations},
                         {"closures", l.whole_closures},
                         {"table_floats", l.whole_table_floats}}},
                       {"after",
                        {{"bytes", l.bytes},
                         {"operations", l.operations},
                         {"closures", l.closures},
                         {"table_floats", l.table_floats}}}});
  nlohmann::ordered_json fixed = nlohmann::ordered_json::object();
  for (const ParamInfo& p : info.params) {
    const auto it = plan.fixed.find(p.name);
    if (it == plan.fixed.end())
      free.push_back(p.name);
    else
      std::visit([&](const auto& v) { fixed[p.name] = v; }, it->second);
  }
  return {{"model", info.name}, {"materials", plan.materials}, {"forms", forms}, {"fixed", fixed},
          {"free", free},       {"left_out", plan.reasons}};
}

/// Why each thing is left out, and what that saves.
void explain(const Options& options, const std::vector<PlannedModel>& plan, const PackResult& result) {
  std::vector<std::string> unused;
  for (const auto& [name, model] : models())
    if (std::none_of(plan.begin(), plan.end(), [&, &n = name](const auto& p) { return p.model->info().name == n; }))
      unused.push_back(name);
  if (options.json) {
    nlohmann::ordered_json out{{"scene", options.scene.empty() ? options.materials : options.scene},
                               {"models", nlohmann::ordered_json::array()}};
    for (const PlannedModel& p : plan) out["models"].push_back(explanation(p, result));
    out["unused_models"] = unused;
    fmt::print("{}\n", out.dump(2));
    return;
  }
  for (const PlannedModel& p : plan) {
    fmt::print("{}, for {}\n", p.model->info().name, fmt::join(p.materials, ", "));
    for (const std::string& reason : p.reasons) fmt::print("  without {}\n", reason);
    for (const PackLine& l : result.lines)
      if (l.model == p.model->info().name)
        fmt::print("  {}: {} -> {} bytes, {} -> {} operations, {} -> {} closures, {} -> {} floats of tables\n",
                   l.representation, l.whole_bytes, l.bytes, l.whole_operations, l.operations, l.whole_closures,
                   l.closures, l.whole_table_floats, l.table_floats);
  }
  if (!unused.empty()) fmt::print("without the models that no material uses: {}\n", fmt::join(unused, ", "));
}

void run(const Options& options) {
  if (int(options.all) + int(!options.scene.empty()) + int(!options.materials.empty()) + int(!options.models.empty()) !=
      1)
    input_error("build: expected one of --all, --scene FILE, --materials FILE or --model NAME");
  if (options.json && options.scene.empty() && options.materials.empty())
    input_error("build: --explain goes with --scene FILE or --materials FILE");
  if (options.error && options.scene.empty() && options.materials.empty())
    input_error("build: --error goes with --scene FILE or --materials FILE");
  if (options.twin && options.scene.empty() && options.materials.empty())
    input_error("build: --twin goes with --scene FILE or --materials FILE");
  // A .blend says what its nodes are, and not what they might be.
  Budget budget{{}, !options.materials.empty(), options.twin};
  if (options.error) budget.error = *options.error / 100;
  const std::vector<PlannedModel> plan =
      !options.scene.empty()       ? plan_scene(needs_of(load_scene(options.scene).materials), budget)
      : !options.materials.empty() ? plan_scene(needs_of(load_materials(options.materials)), budget)
                                   : plan_models(options.models);
  PackOptions pack{options.out, options.addon, plan, {}};
  const auto start = std::chrono::steady_clock::now();
  pack.progress = [&](const std::string& what, int done, int total) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print(stderr, "brdfc build: {}/{} {:<20} {:6.1f} s\n", done, total, what, seconds);
  };
  const PackResult result = build_pack(pack);
  if (options.scene.empty() && options.materials.empty())
    print_table(result);
  else
    explain(options, plan, result);
  fmt::print(stderr, "brdfc build: wrote {} and {}\n", result.zip.string(), result.folder.string());
}

}  // namespace

void add_build_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* c = app.add_subcommand("build", "Write the Blender extension");
  c->add_flag("--all", options->all, "Every model");
  c->add_option(
      "--scene", options->scene,
      "Only what the materials of a scene file need: models, forms, lobes, and parameters that are not constant");
  c->add_option("--materials", options->materials,
                "The same for a file that the extension wrote in Blender (Write Materials): what its .blend uses");
  c->add_flag("--explain", options->json,
              "With --scene or --materials: what is left out, why and what that saves, as JSON");
  c->add_option(
       "--error", options->error,
       "With --scene or --materials: percent of the light (relative L1 of f cos) that a fitted form may be off,\n"
       "where a material of a scene leaves its form open, or beside the sampled form of a .blend; without, no\n"
       "form is fitted unasked")
      ->check(CLI::Range(0.0, 100.0));
  c->add_flag(
      "--twin", options->twin,
      "With --scene or --materials: also twins, Blender's own nodes for where Open Shading Language does not run,\n"
      "of every material whose parameters are constant");
  c->add_option("--model", options->models, "Only these models (repeat for several)");
  c->add_option("--out", options->out, "Folder for the extension and its zip")->required();
  c->add_option("--addon", options->addon, "Folder with the add-on's Python");
  c->callback([options] { run(*options); });
}

}  // namespace brdfc
