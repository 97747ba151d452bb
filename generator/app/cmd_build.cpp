// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/commands.h"
#include "app/numbers.h"
#include "app/scene_needs.h"
#include "check/check.h"
#include "core/data_dir.h"
#include "core/json_text.h"
#include "core/parse.h"
#include "core/text.h"
#include "forms/form.h"
#include "pack/brdf_files.h"
#include "pack/pack.h"
#include "pack/standalone.h"
#include "pack/target.h"
#include "plan/costs.h"
#include "plan/plan.h"
#include "reference/scene.h"
#include "reference/views.h"

namespace brdfc::app {
namespace {

struct Options {
  bool all = false, json = false, twin = false, fit_bases = false, osl_only = false;
  std::optional<double> error, time;  ///< percent of the light; units of Blender's Glossy node
  std::string scene, materials, out, osl, brdf, addon;
  std::vector<std::string> models;
};

void print_table(const pack::Result& result) {
  fmt::print("{:<20} {:<8} {:>8} {:>6} {:>10} {:>11} {:>11} {:>12} {:>11} {:>8} {:>12}\n", "model", "form", "closures",
             "slots", "operations", "relative_l1", "albedo", "table_floats", "table_error", "bytes", "albedo_bytes");
  for (const pack::Line& l : result.lines)
    fmt::print("{:<20} {:<8} {:>8} {:>6} {:>10} {:>11} {:>11.2e} {:>12} {:>11.2e} {:>8} {:>12}\n", l.model,
               l.representation, l.closures, l.slots, l.operations,
               l.error.relative_l1 ? fmt::format("{:.2e}", *l.error.relative_l1) : "expectation", l.error.albedo,
               l.table_floats, l.table_error, l.bytes, l.albedo_bytes);
}

/// The relative L1 error, or a statement that the form equals the model in expectation. Null for a form that these
/// materials can't have, and for a fit that is neither in the pack nor asked for by a budget.
nlohmann::ordered_json error_of(const plan::PlannedModel& plan, const plan::FormChoice& choice,
                                const pack::Result& result) {
  constexpr const char* kExpectation = "expectation";
  if (!choice.exists) return nullptr;
  if (choice.error) return *choice.error;
  for (const pack::Line& l : result.lines)
    if (l.model == plan.model->info().name && l.representation == choice.form->name())
      return l.error.relative_l1 ? nlohmann::ordered_json(*l.error.relative_l1) : kExpectation;
  if (choice.form->made_of_fit()) return nullptr;
  if (choice.form->draws()) return kExpectation;
  return *choice.form->error(*plan.model, {plan.fixed}).relative_l1;
}

nlohmann::ordered_json cost_json(const std::optional<double>& cost) {
  return cost ? nlohmann::ordered_json(*cost) : nullptr;
}

nlohmann::ordered_json explanation(const plan::PlannedModel& plan, const pack::Result& result) {
  const ModelInfo& info = plan.model->info();
  nlohmann::ordered_json choices = nlohmann::ordered_json::array();
  for (const plan::FormChoice& c : plan.choices)
    choices.push_back({{"form", c.form->name()},
                       {"taken", c.taken},
                       {"cost", cost_json(c.cost)},
                       {"error", error_of(plan, c, result)},
                       {"why", c.why}});
  nlohmann::ordered_json of_materials = nlohmann::ordered_json::array();
  for (const plan::FormChange& m : plan.material_forms)
    of_materials.push_back({{"material", m.id},
                            {"before", {{"form", m.before->name()}, {"cost", cost_json(m.cost_before)}}},
                            {"after", {{"form", m.after->name()}, {"cost", cost_json(m.cost_after)}}}});
  nlohmann::ordered_json forms = nlohmann::ordered_json::array(), free = nlohmann::ordered_json::array();
  for (const pack::Line& l : result.lines)
    if (l.model == info.name)
      forms.push_back({{"form", l.representation},
                       {"before",
                        {{"bytes", l.whole_bytes},
                         {"operations", l.whole_operations},
                         {"statements", l.whole_statements},
                         {"closures", l.whole_closures},
                         {"table_floats", l.whole_table_floats}}},
                       {"after",
                        {{"bytes", l.bytes + l.albedo_bytes},
                         {"operations", l.operations},
                         {"statements", l.statements},
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
  return {{"model", info.name},
          {"materials", plan.materials},
          {"material_forms", of_materials},
          {"choices", choices},
          {"forms", forms},
          {"fixed", fixed},
          {"free", free},
          {"view_cosines", {plan.views.low, plan.views.high}},
          {"left_out", plan.reasons}};
}

/// Prints which forms exist and which are taken, the reason for each thing left out, and what that saves.
void explain(const Options& options, const std::vector<plan::PlannedModel>& plan, const pack::Result& result) {
  std::vector<std::string> unused;
  for (const auto& [name, model] : models())
    if (std::none_of(plan.begin(), plan.end(), [&, &n = name](const auto& p) { return p.model->info().name == n; }))
      unused.push_back(name);
  if (options.json) {
    nlohmann::ordered_json out{{"scene", options.scene.empty() ? options.materials : options.scene},
                               {"models", nlohmann::ordered_json::array()}};
    for (const plan::PlannedModel& p : plan) out["models"].push_back(explanation(p, result));
    out["unused_models"] = unused;
    fmt::print("{}\n", json_text(out, 2));
    return;
  }
  for (const plan::PlannedModel& p : plan) {
    fmt::print("{}, for {}\n", p.model->info().name, join(p.materials, ", "));
    for (const plan::FormChoice& c : p.choices) {
      const nlohmann::ordered_json error = error_of(p, c, result);
      fmt::print("  {:<10} {:>6} {:>11}  {} {}\n", c.form->name(), c.cost ? fmt::format("{:.2f}x", *c.cost) : "-",
                 error.is_number()   ? fmt::format("{:.2e}", error.get<double>())
                 : error.is_string() ? error.get<std::string>()
                                     : "-",
                 c.taken ? "taken:" : "not taken:", c.why);
    }
    for (const std::string& reason : p.reasons) fmt::print("  without {}\n", reason);
    for (const pack::Line& l : result.lines)
      if (l.model == p.model->info().name)
        fmt::print(
            "  {}: {} -> {} bytes, {} -> {} operations, {} -> {} statements, {} -> {} closures, {} -> {} floats of "
            "tables\n",
            l.representation, l.whole_bytes, l.bytes + l.albedo_bytes, l.whole_operations, l.operations,
            l.whole_statements, l.statements, l.whole_closures, l.closures, l.whole_table_floats, l.table_floats);
  }
  fmt::print("costs: CPU time with default parameters, in units of Blender's Glossy node at equal samples\n");
  if (!unused.empty()) fmt::print("without the models that no material uses: {}\n", join(unused, ", "));
}

/// Refuses what only makes sense for an extension.
void require_alone(const Options& options, const char* option) {
  if (!options.scene.empty() || !options.materials.empty() || !options.out.empty() || !options.addon.empty() ||
      options.error || options.time || options.json || options.twin || options.fit_bases || options.osl_only ||
      (!options.osl.empty() && !options.brdf.empty()))
    input_error("build: {} DIR goes with --all or --model NAME alone", option);
}

/// All texts are made before the first file is written.
template <class Texts> void write_files(const std::filesystem::path& folder, const Texts& texts) {
  for (const auto& [name, text] : texts) pack::write_text(folder / name, text);
  fmt::print(stderr, "brdfc build: wrote {} files to {}\n", texts.size(), folder.string());
}

/// Writes the models as files of BRDF Explorer.
void write_brdf(const Options& options) {
  require_alone(options, "--brdf");
  std::vector<const Model*> models;
  for (const std::string& name : options.models) models.push_back(&find_model(name));
  if (models.empty()) models = models_named("");
  const pack::BrdfFiles files = pack::brdf_files(models, data_path("explorer") / "library.glsl");
  for (const std::string& why : files.left_out) fmt::print(stderr, "brdfc build: without {}\n", why);
  write_files(options.brdf, files.texts);
}

/// Writes the models as OSL that needs no extension.
void write_osl(const Options& options) {
  require_alone(options, "--osl");
  write_files(options.osl, pack::standalone_files(options.models));
}

void run(const Options& options) {
  if (!options.brdf.empty()) {
    write_brdf(options);
    return;
  }
  if (!options.osl.empty()) {
    write_osl(options);
    return;
  }
  if (options.out.empty())
    input_error("build: expected --out DIR, the folder for the extension, --osl DIR or --brdf DIR");
  if (int(options.all) + int(!options.scene.empty()) + int(!options.materials.empty()) + int(!options.models.empty()) !=
      1)
    input_error("build: expected one of --all, --scene FILE, --materials FILE or --model NAME");
  if (options.scene.empty() && options.materials.empty())
    for (const auto& [name, given] : {std::pair("--explain", options.json),
                                      {"--error", options.error.has_value()},
                                      {"--time", options.time.has_value()},
                                      {"--fit", options.fit_bases},
                                      {"--twin", options.twin},
                                      {"--osl-only", options.osl_only}})
      if (given) input_error("build: {} goes with --scene FILE or --materials FILE", name);
  pack::require_target(options.out);
  const std::filesystem::path addon =
      options.addon.empty() ? data_path("blender_addon") : std::filesystem::path(options.addon);
  const std::filesystem::path costs = addon / "costs.csv";
  // A .blend file states which representation its nodes have, but not which others they could have.
  plan::Budget budget{{}, !options.materials.empty(), options.twin, options.fit_bases, {}, plan::Costs(costs)};
  budget.nodes = !options.osl_only;
  if (options.error) budget.error = *options.error / 100;
  if (options.time) {
    budget.time = options.time;
    if (!std::filesystem::exists(costs))
      input_error("{}: no such file, and --time needs what forms cost", costs.string());
  }
  std::vector<plan::PlannedModel> plan;
  if (!options.scene.empty()) {
    const reference::Scene scene = load_scene(options.scene);
    print_notes(scene.notes);
    for (const reference::Light& l : scene.lights)
      if ((l.kind == reference::Light::Kind::Point || l.kind == reference::Light::Kind::Sun) && l.radius == 0)
        budget.sizeless.push_back(l.key);
    // The extension also finds bright spots in an image, and aims at them if there is room.
    budget.lamps = int(scene.lights.size()) + (scene.environment.image ? forms::kMaxLamps : 0);
    plan = plan::plan_scene(needs_of(scene.materials, reference::seen_cosines(scene)), budget);
  } else if (!options.materials.empty()) {
    const reference::UsedMaterials used = reference::load_materials(options.materials);
    budget.sizeless = used.sizeless_lamps;
    budget.lamps = used.lamps;
    plan = plan::plan_scene(needs_of(used.materials), budget);
  } else {
    plan = plan::plan_models(options.models);
  }
  for (const plan::PlannedModel& p : plan) check::require_vital(*p.model);
  pack::Options pack{options.out, addon, data_path("python/brdfc"), plan, budget.costs, {}};
  const std::string& cut_to = options.scene.empty() ? options.materials : options.scene;
  pack.cut = std::filesystem::path(cut_to).stem().string();
  const auto start = std::chrono::steady_clock::now();
  pack.progress = [&](const std::string& what, int done, int total) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print(stderr, "brdfc build: {}/{} {:<20} {:6.1f} s\n", done, total, what, seconds);
  };
  const pack::Result result = pack::build_pack(pack);
  if (options.scene.empty() && options.materials.empty())
    print_table(result);
  else
    explain(options, plan, result);
  fmt::print(stderr, "brdfc build: wrote {} and {}\n", result.zip.string(), result.folder.string());
}

}  // namespace

void add_build_command(Command app) {
  auto options = std::make_shared<Options>();
  const Command c = app.add_subcommand("build", "Writes the Blender extension, whole or for one scene");
  const std::string what = "What (one of them)", forms = "Forms, with --scene or --materials", where = "Where";
  c.add_flag("--all", options->all, "Every model").group(what);
  c.add_option("--model", options->models, "Only these models (repeat for several)").group(what);
  c.add_option("--scene", options->scene,
               "Only what the materials of a scene file need: models, forms, parameters that are not constant, "
               "view angles")
      .group(what);
  c.add_option("--materials", options->materials,
               "Only what a .blend uses, as listed in a file that the extension wrote (Write Materials)")
      .group(what);
  add_number(c, "--error", options->error,
             {.low = 0, .high = 100, .unit = '%', .in_words = "percent from 0 to 100, as 5 or 5%"},
             "Largest error of a fitted form in percent of the light (relative L1 of f cos), for example 5%. Applies\n"
             "to materials of a scene that leave their form open, and to .blend materials with a sampled form, which\n"
             "get a fitted form as well. By default, forms are fitted only on request")
      .group(forms);
  add_number(c, "--time", options->time,
             {.low = 0, .above_low = true, .unit = 'x', .in_words = "a positive number, as 1.2 or 1.2x"},
             "Largest cost of a form for materials that leave their form open: CPU time at equal samples, in units\n"
             "of Blender's Glossy node, for example 1.2x; --explain prints the costs of forms")
      .group(forms);
  c.add_flag("--fit", options->fit_bases,
             "Fits closures to the materials where possible, as the base of their aimed forms, which reduces noise\n"
             "under skies and images; takes seconds to minutes for each material")
      .group(forms);
  c.add_flag("--twin", options->twin,
             "Adds a twin for every material with constant parameters: Blender's own nodes, for devices without\n"
             "Open Shading Language")
      .group(forms);
  c.add_flag("--osl-only", options->osl_only,
             "Omits the formula nodes that materials with an open form use if Open Shading Language is off")
      .group(forms);
  c.add_flag("--explain", options->json,
             "Prints as JSON which forms are available and chosen, with reasons, what is left out, and what that saves")
      .group(forms);
  c.add_option("--out", options->out, "Folder for the extension and its zip").group(where);
  c.add_option("--osl", options->osl,
               "Writes to this folder, instead of an extension, every model (or those of --model) as a shader for\n"
               "Blender's Script node, and its formulas as OSL without closures")
      .group(where);
  c.add_option("--brdf", options->brdf,
               "Writes to this folder, instead of an extension, every model (or those of --model) as files of\n"
               "Disney's BRDF Explorer, one for each combination of choices")
      .group(where);
  c.add_option("--addon", options->addon, "Folder with the add-on's Python, instead of the one in `brdfc where`")
      .group(where);
  c.callback([options] { run(*options); });
}

}  // namespace brdfc::app
