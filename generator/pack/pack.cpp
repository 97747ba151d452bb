// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/pack.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <map>
#include <mutex>

#include "core/hash.h"
#include "core/json_text.h"
#include "core/process.h"
#include "fit/fit.h"
#include "forms/form.h"
#include "measure/albedo_file.h"
#include "measure/bound_model.h"
#include "measure/fold.h"
#include "measure/stored_albedo.h"
#include "pack/addon.h"
#include "pack/manifest.h"
#include "pack/python_package.h"
#include "pack/target.h"
#include "pack/zip.h"
#include "plan/costs.h"

namespace brdfc::pack {
namespace {

namespace fs = std::filesystem;

/// The folder's name does not depend on the extension's id, because programs that read packs know it.
constexpr const char* kFolder = "brdfc_shaders";
/// The manifest's "generator" entry, before the version.
constexpr const char* kGenerator = "brdfc ";

/// Moves `fresh` to `target`. Where the file system can exchange two names this is one step, so that a target always
/// exists. Elsewhere the old folder is moved away first. It is deleted with the staging folder.
void replace_folder(const fs::path& fresh, const fs::path& target, const fs::path& scratch) {
  if (fs::exists(target)) {
    if (exchange(fresh, target)) return;
    fs::rename(target, scratch);
  }
  fs::rename(fresh, target);
}

struct BuiltModel {
  Json manifest;
  std::map<std::string, std::string> files;
  std::vector<Line> lines;
};

/// The setting for which a form of a plan is made.
forms::Setting setting_of(const plan::PlannedModel& plan, const forms::Form& form) {
  forms::Setting setting{plan.fixed, plan.views, plan.max_lamps, plan.base};
  setting.fixed.merge(form.values(*plan.model, plan.fixed));
  return setting;
}

/// `whole_table` is the model's albedo table, if it has one.
BuiltModel build_model(const plan::PlannedModel& plan, const measure::AlbedoTable& whole_table,
                       const plan::Costs& costs, const fs::path& scratch) {
  const Model& model = *plan.model;
  const ModelInfo& info = model.info();
  BuiltModel built;
  Json& j = built.manifest;
  j = {{"label", info.label},
       {"look", name_of(info.look)},
       {"paper", info.paper},
       {"equations", info.equations},
       {"doc", info.doc},
       {"isotropic", info.properties.isotropic},
       {"scatter", model.has_scatter()},
       {"through", through_json(model)}};
  j["parameters"] = parameters_json(model, plan.fixed);
  j["fixed"] = values_json(plan.fixed);
  if (const Json roles = optical_json(model, plan.fixed); !roles.empty()) j["fixed_optical"] = roles;
  if (!plan.views.all()) j["view_cosines"] = {plan.views.low, plan.views.high};

  const bool with_table = measure::has_albedo_table(model);
  const auto folded = [&](const ParamValues& fixed) {
    return with_table ? measure::fold(whole_table, model, fixed, plan.views) : measure::AlbedoTable();
  };
  const measure::AlbedoTable table = folded(plan.fixed);
  const std::string table_file = "tables/" + info.name + "_albedo.exr";
  if (with_table) {
    const fs::path exr = scratch / (info.name + ".exr");
    measure::write_albedo_exr(table, exr);
    built.files[table_file] = read_text(exr);
    fs::remove(exr);
  }

  j["auto"] = plan.forms.front()->name();
  for (const forms::Form* form : plan.forms) {
    const forms::Setting setting = setting_of(plan, *form);
    const ParamValues& fixed = setting.fixed;
    const fit::Fit* fit = form->fit(model, setting);
    const std::size_t of_whole_fit = fit ? fit->size() : 0,
                      of_fit = fit && !plan.views.all() ? fit->cut_to(plan.views).size() : of_whole_fit;
    const measure::AlbedoTable of_form = fixed == plan.fixed ? table : folded(fixed);
    const forms::Shader shader = form->write(model, of_form, setting);
    // The savings of a plan are shown relative to the whole shader; if nothing was left out, that is this one. A fitted
    // form exists for these parameters only.
    const ParamValues whole_fixed = form->made_of_fit() ? fixed : ParamValues{};
    const bool cut = !plan.views.all() || (!form->made_of_fit() && !plan.fixed.empty());
    const forms::Shader whole =
        cut && !form->native()
            ? form->write(model, with_table ? measure::fold(whole_table, model, whole_fixed) : whole_table,
                          {whole_fixed})
            : shader;
    const forms::FormError error = form->error(model, setting);
    const std::optional<double> cost = form->cost_is_measured(setting) ? costs.of(model, *form) : std::nullopt;
    const std::string file = form->native() ? (form->made_of_fit() ? "twins/" : "nodes/") + shader.name + ".json"
                                            : "shaders/" + shader.name + ".osl";
    built.files[file] = shader.source;
    const std::string albedo_file = "shaders/" + shader.name + "_albedo.osl";
    if (!shader.albedo.empty()) built.files[albedo_file] = shader.albedo;
    built.lines.push_back({info.name, form->name(), shader.closures, shader.slots, shader.operations, shader.statements,
                           error, of_form.size() + of_fit, table.error, shader.source.size(), shader.albedo.size(),
                           whole.closures, whole.operations, whole.statements, whole_table.size() + of_whole_fit,
                           whole.source.size() + whole.albedo.size()});
    j["representations"][form->name()] = {
        {form->native() ? "nodes" : "shader", file},
        {"only", values_json(form->values(model, plan.fixed))},
        {"closures", shader.closures},
        {"slots", shader.slots},
        {"numbers", shader.numbers},
        {"operations", shader.operations},
        {"error", error_json(error)},
        {"cost", cost ? Json(*cost) : Json()},
        {"lamps", shader.lamps},
        {"warnings", form->warnings(model, shader)},
        {"axis", axis_json(form->axis(model, setting))},
        {"highlight", highlight_json(model, *form, shader, fixed)},
        {"sha256", sha256(shader.source)},
        {"albedo_shader", shader.albedo.empty() ? Json() : Json(albedo_file)},
        {"albedo_sha256", shader.albedo.empty() ? Json() : Json(sha256(shader.albedo))}};
  }
  if (with_table) j["albedo"] = table_json(table, table_file, model, plan.fixed);
  return built;
}

}  // namespace

void require_target(const fs::path& out) {
  require_replaceable(out / kFolder, "manifest.json", fmt::format("\"generator\": \"{}", kGenerator));
}

Result build_pack(const Options& options) {
  require_target(options.out);
  const std::vector<plan::PlannedModel>& chosen = options.models;
  std::map<std::string, std::string> members = addon_files(options.addon, options.cut);
  make_folder(options.out);

  const Staging staging(options.out);
  std::vector<BuiltModel> built(chosen.size());
  std::mutex mutex;
  int begun = 0;
  // A thread that waits for parts of a model must not begin another model, because recordings belong to their thread.
  std::vector<measure::AlbedoTable> tables(chosen.size());
  const auto tabulate = [&](std::size_t i) {
    const Model& model = *chosen[i].model;
    if (measure::has_albedo_table(model))
      tbb::this_task_arena::isolate([&] { tables[i] = measure::albedo_table_of(model); });
  };
  const auto build = [&](std::size_t i) {
    {
      const std::lock_guard lock(mutex);
      if (options.progress) options.progress(chosen[i].model->info().name, begun++, int(chosen.size()));
    }
    tbb::this_task_arena::isolate([&] { built[i] = build_model(chosen[i], tables[i], options.costs, staging.path()); });
  };
  // Tables come first: they show errors in a model sooner than a fit does.
  tbb::parallel_for(std::size_t(0), chosen.size(), tabulate, tbb::simple_partitioner());
  // Fits that are not stored are made one at a time, using all cores. Then models are built in parallel, so that the
  // serial parts of one keep no core waiting.
  for (const plan::PlannedModel& plan : chosen)
    for (const forms::Form* form : plan.forms) form->prepare(*plan.model, setting_of(plan, *form));
  tbb::parallel_for(std::size_t(0), chosen.size(), build, tbb::simple_partitioner());

  Result result;
  Json manifest = {{"format", 1},
                   {"generator", std::string(kGenerator) + BRDFC_VERSION},
                   {"hash", ""},
                   {"closure_slots", {{"most", kMaxClosures}, {"lamp", slots(ClosureKind::PhongRamp)}}},
                   {"lobes", {{"most", kMostLobes}, {"fitted", kFittedLobes}}},
                   {"looks", looks_json()},
                   {"models", Json::object()}};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    manifest["models"][chosen[i].model->info().name] = built[i].manifest;
    members.merge(built[i].files);
    result.lines.insert(result.lines.end(), built[i].lines.begin(), built[i].lines.end());
  }
  std::vector<const Model*> formulas;
  for (const plan::PlannedModel& plan : chosen) formulas.push_back(plan.model);
  for (const auto& [name, data] : python_package(formulas, options.python))
    if (name.ends_with(".py") && name != "mitsuba.py") members["brdfc/" + name] = data;  // no use in Blender
  members["brdfc/_closures.py"] = closures_module();
  std::string everything;
  for (const auto& [name, data] : members) everything += name + '\0' + data;
  manifest["hash"] = sha256(everything);
  members["manifest.json"] = json_text(manifest, 1) + "\n";

  const fs::path folder = staging.path() / kFolder;
  for (const auto& [name, data] : members) write_text(folder / name, data);
  const std::string zip_name = fmt::format("{}-{}.zip", extension_id(options.cut), BRDFC_VERSION);
  write_zip(staging.path() / zip_name, members);

  result.folder = options.out / kFolder;
  result.zip = options.out / zip_name;
  replace_folder(folder, result.folder, staging.path() / "old");
  fs::rename(staging.path() / zip_name, result.zip);
  if (options.progress) options.progress("done", int(chosen.size()), int(chosen.size()));
  return result;
}

}  // namespace brdfc::pack
