// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/pack.h"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "closures/closure_pool.h"
#include "core/hash.h"
#include "measure/albedo_table.h"
#include "measure/bound_model.h"
#include "pack/nodes.h"
#include "pack/shader.h"
#include "represent/fit.h"
#include "represent/twin.h"

namespace brdfc {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kExtensionId = "brdfc_shaders";

std::string read_text(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) input_error("{}: cannot be read", path.string());
  return text.str();
}

void write_text(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) input_error("{}: cannot be written", path.string());
}

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

Json error_json(const RepresentationError& e) {
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

/// What a user must know of a form; the add-on turns each into words where it applies.
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

/// Whether a clamp shows in a form by how bright its highlight is: in closures that are glossy, and directions drawn
/// beside a base or lobes; not where a mirror shows it before.
bool has_highlight(RepresentationKind kind, bool mirror, const Shader& shader) {
  const bool ramps = shader.slots > shader.closures;
  return !mirror && (kind == RepresentationKind::Twin || kind == RepresentationKind::Aimed ||
                     ((kind == RepresentationKind::Exact || kind == RepresentationKind::Fitted) && ramps));
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

struct ArchiveDelete {
  void operator()(archive* a) const { archive_write_free(a); }
};

/// Fixed times and order: the same members give the same bytes.
void write_zip(const fs::path& path, const std::map<std::string, std::string>& members) {
  const std::unique_ptr<archive, ArchiveDelete> zip(archive_write_new());
  const auto require = [&](int status) {
    if (status != ARCHIVE_OK) input_error("{}: cannot be written: {}", path.string(), archive_error_string(zip.get()));
  };
  require(archive_write_set_format_zip(zip.get()));
  require(archive_write_open_filename(zip.get(), path.c_str()));
  for (const auto& [name, data] : members) {
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(), archive_entry_free);
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_size(entry.get(), static_cast<la_int64_t>(data.size()));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    archive_entry_set_mtime(entry.get(), 1577836800, 0);  // 2020-01-01
    require(archive_write_header(zip.get(), entry.get()));
    if (archive_write_data(zip.get(), data.data(), data.size()) != la_ssize_t(data.size()))
      input_error("{}: cannot be written: {}", path.string(), archive_error_string(zip.get()));
  }
  require(archive_write_close(zip.get()));
}

/// A folder beside the target that goes away unless renamed.
class Staging {
 public:
  explicit Staging(const fs::path& out) : path_(out / fmt::format("{}{}", kPrefix, getpid())) {
    std::error_code error;
    remove_abandoned(out);
    fs::create_directories(path_, error);
    if (error) input_error("{}: cannot be created: {}", path_.string(), error.message());
  }
  ~Staging() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;
  const fs::path& path() const { return path_; }

 private:
  static constexpr const char* kPrefix = ".brdfc-build-";

  /// What a build that was killed left behind: its process is gone.
  static void remove_abandoned(const fs::path& out) {
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(out, ignored)) {
      const std::string name = entry.path().filename().string();
      if (!name.starts_with(kPrefix)) continue;
      pid_t process = 0;
      const char* first = name.data() + std::string_view(kPrefix).size();
      const auto [end, bad] = std::from_chars(first, name.data() + name.size(), process);
      if (bad != std::errc() || end != name.data() + name.size() || process <= 0) continue;
      if (kill(process, 0) != 0 && errno == ESRCH) fs::remove_all(entry.path(), ignored);
    }
  }

  fs::path path_;
};

/// Puts `fresh` where `target` is, in one step where the file system can exchange two names, so that at no time there
/// is none; elsewhere the old folder steps aside first. It goes with the staging folder.
void replace_folder(const fs::path& fresh, const fs::path& target, const fs::path& scratch) {
  if (fs::exists(target)) {
#ifdef RENAME_EXCHANGE
    if (renameat2(AT_FDCWD, fresh.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) == 0) return;
#endif
    fs::rename(target, scratch);
  }
  fs::rename(fresh, target);
}

struct BuiltModel {
  Json manifest;
  std::map<std::string, std::string> files;
  std::vector<PackLine> lines;
};

/// What a form looks its closures up in; none but a fitted one, and an aimed one whose base is a fit, do.
const Fit* fit_in(RepresentationKind kind, const PlannedModel& plan, const ParamValues& fixed) {
  const bool base = kind == RepresentationKind::Aimed && plan.base == AimedBase::Fitted;
  if (kind != RepresentationKind::Fitted && !base) return nullptr;
  return &fit_of(*plan.model, without_factors(*plan.model, fixed));
}

/// The number that a fit runs over, and how far.
Json axis_json(const Fit* fit) {
  if (!fit || !fit->axis()) return {};
  return {{"name", fit->axis()->parameter}, {"min", fit->axis()->low}, {"max", fit->axis()->high}};
}

/// How bright a form's highlight is: f cos about the mirror direction, the brighter of two views; and over which number
/// of its sliders, if any. A clamp on indirect light shows the earlier the brighter it is.
Json highlight_json(const Model& model, const ParamValues& fixed) {
  constexpr int kValues = 9;
  const ModelInfo& info = model.info();
  std::vector<const ParamInfo*> numbers;
  const std::set<std::string> scales = factors(model, fixed);
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Number && !fixed.count(p.name) && !scales.count(p.name)) numbers.push_back(&p);
  const auto declared =
      std::ranges::find(numbers, info.properties.fit_axis, [](const ParamInfo* p) { return p->name; });
  const ParamInfo* over = declared != numbers.end() ? *declared : numbers.size() == 1 ? numbers[0] : nullptr;
  Json values = Json::array(), bright = Json::array();
  for (int i = 0; i < (over ? kValues : 1); ++i) {
    ParamValues at = fixed;
    if (over) {
      const double number = fit_axis(*over).at(double(i) / (kValues - 1));
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

/// What a form of a plan has no parameters for.
ParamValues fixed_in(const PlannedModel& plan, RepresentationKind kind) {
  ParamValues fixed = plan.fixed;
  fixed.merge(form_values(*plan.model, kind, plan.fixed));
  return fixed;
}

/// Makes or reads what a form is made of, so that asking for it takes no time afterwards.
void prepare_fit(const PlannedModel& plan, RepresentationKind kind) {
  const ParamValues values = without_factors(*plan.model, fixed_in(plan, kind));
  if (kind == RepresentationKind::Twin)
    twin_of(*plan.model, values);
  else
    fit_of(*plan.model, values);
}

BuiltModel build_model(const PlannedModel& plan, const Costs& costs, const fs::path& scratch) {
  const Model& model = *plan.model;
  const ModelInfo& info = model.info();
  BuiltModel built;
  Json& j = built.manifest;
  j = {{"label", info.label},
       {"paper", info.paper},
       {"equations", info.equations},
       {"doc", info.doc},
       {"isotropic", info.properties.isotropic},
       {"scatter", model.has_scatter()}};
  j["parameters"] = Json::array();
  for (const ParamInfo& p : info.params)
    if (!plan.fixed.count(p.name)) j["parameters"].push_back(parameter_json(p));
  j["fixed"] = values_json(plan.fixed);
  if (!plan.views.all()) j["view_cosines"] = {plan.views.low, plan.views.high};

  measure::AlbedoTable table, whole_table;
  const std::string table_file = "tables/" + info.name + "_albedo.exr";
  if (measure::has_albedo_table(model)) {
    whole_table = measure::albedo_table_of(model);
    table = fold(whole_table, model, plan.fixed, plan.views);
    const fs::path exr = scratch / (info.name + ".exr");
    measure::write_albedo_exr(table, exr);
    built.files[table_file] = read_text(exr);
    fs::remove(exr);
  }

  j["auto"] = name_of(plan.forms.front());
  for (RepresentationKind kind : plan.forms) {
    const bool twin = kind == RepresentationKind::Twin;
    const ParamValues fixed = fixed_in(plan, kind);
    const Fit* fit = fit_in(kind, plan, fixed);
    const std::size_t of_whole_fit = fit ? fit->size() : 0,
                      of_fit = fit && !plan.views.all() ? fit->seen(plan.views).size() : of_whole_fit;
    const measure::AlbedoTable of_form = fixed == plan.fixed ? table : fold(whole_table, model, fixed, plan.views);
    const Shader shader = twin ? write_nodes(model, fixed)
                               : write_shader(model, kind, of_form, fixed, plan.views, plan.max_lamps, plan.base);
    // What the plan has saved shows against the whole shader, which is this one where nothing was left out.
    // What is fitted exists for these parameters only.
    const ParamValues whole_fixed = is_fit(kind) ? fixed : ParamValues{};
    const bool cut = !plan.views.all() || (!is_fit(kind) && !plan.fixed.empty());
    const Shader whole =
        cut && !twin ? write_shader(model, kind, fold(whole_table, model, whole_fixed), whole_fixed) : shader;
    const RepresentationError error = measure_error(model, kind, fixed, plan.views);
    // Costs were measured with the base that a model declares.
    const bool measured = kind != RepresentationKind::Aimed || plan.base == AimedBase::Declared;
    const std::optional<double> cost = measured ? costs.of(model, kind) : std::nullopt;
    const std::string file = twin ? "twins/" + shader.name + ".json" : "shaders/" + shader.name + ".osl";
    built.files[file] = shader.source;
    const std::string albedo_file = "shaders/" + shader.name + "_albedo.osl";
    if (!shader.albedo.empty()) built.files[albedo_file] = shader.albedo;
    built.lines.push_back({info.name, name_of(kind), shader.closures, shader.slots, shader.operations,
                           shader.statements, error, of_form.size() + of_fit, table.error, shader.source.size(),
                           shader.albedo.size(), whole.closures, whole.operations, whole.statements,
                           whole_table.size() + of_whole_fit, whole.source.size() + whole.albedo.size()});
    j["representations"][name_of(kind)] = {
        {twin ? "nodes" : "shader", file},
        {"only", values_json(form_values(model, kind, plan.fixed))},
        {"closures", shader.closures},
        {"slots", shader.slots},
        {"closure_bytes", shader.closure_bytes},
        {"lamp_bytes", shader.lamp_bytes},
        {"operations", shader.operations},
        {"error", error_json(error)},
        {"cost", cost ? Json(*cost) : Json()},
        {"lamps", shader.lamps},
        {"warnings", warnings(kind, model.has_mirror(), shader)},
        {"axis", axis_json(is_fit(kind) ? fit : nullptr)},
        {"highlight", has_highlight(kind, model.has_mirror(), shader) ? highlight_json(model, fixed) : Json()},
        {"sha256", sha256(shader.source)},
        {"albedo_shader", shader.albedo.empty() ? Json() : Json(albedo_file)},
        {"albedo_sha256", shader.albedo.empty() ? Json() : Json(sha256(shader.albedo))}};
  }
  if (measure::has_albedo_table(model)) j["albedo"] = table_json(table, table_file, model, plan.fixed);
  return built;
}

}  // namespace

PackResult build_pack(const PackOptions& options) {
  const std::vector<PlannedModel>& chosen = options.models;
  if (!fs::exists(options.addon / "blender_manifest.toml"))
    input_error("{}: expected the add-on's folder with blender_manifest.toml", options.addon.string());
  std::error_code error;
  fs::create_directories(options.out, error);
  if (error || !fs::is_directory(options.out))
    input_error("{}: expected a folder that can be written", options.out.string());

  const Staging staging(options.out);
  std::vector<BuiltModel> built(chosen.size());
  std::mutex mutex;
  int begun = 0;
  const auto build = [&](std::size_t i) {
    {
      const std::lock_guard lock(mutex);
      if (options.progress) options.progress(chosen[i].model->info().name, begun++, int(chosen.size()));
    }
    // A thread that waits for parts of this model must not begin another one: recordings belong to their thread.
    tbb::this_task_arena::isolate([&] { built[i] = build_model(chosen[i], options.costs, staging.path()); });
  };
  // Fits that are not stored are made one at a time, by all cores; then models side by side, so that what one does in
  // line keeps no core waiting.
  for (const PlannedModel& plan : chosen)
    for (const RepresentationKind kind : plan.forms)
      if (is_fit(kind) || (kind == RepresentationKind::Aimed && plan.base == AimedBase::Fitted))
        prepare_fit(plan, kind);
  tbb::parallel_for(std::size_t(0), chosen.size(), build, tbb::simple_partitioner());

  PackResult result;
  std::map<std::string, std::string> members;
  // Blender's nodes that join closures take of the pool, too: Mix Shader makes two products and their sum.
  Json manifest = {{"format", 1},
                   {"generator", std::string("brdfc ") + BRDFC_VERSION},
                   {"hash", ""},
                   {"closure_pool", {{"bytes", kPoolBytes}, {"mix", 3 * kPoolNode}, {"add", kPoolNode}}},
                   {"models", Json::object()}};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    manifest["models"][chosen[i].model->info().name] = built[i].manifest;
    members.merge(built[i].files);
    result.lines.insert(result.lines.end(), built[i].lines.begin(), built[i].lines.end());
  }
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(options.addon)) {
    const std::string name = entry.path().lexically_relative(options.addon).generic_string();
    if (entry.path().extension() == ".py" || name == "blender_manifest.toml") members[name] = read_text(entry.path());
  }
  std::string everything;
  for (const auto& [name, data] : members) everything += name + '\0' + data;
  manifest["hash"] = sha256(everything);
  members["manifest.json"] = manifest.dump(1) + "\n";

  const fs::path folder = staging.path() / kExtensionId;
  for (const auto& [name, data] : members) write_text(folder / name, data);
  const std::string zip_name = fmt::format("{}-{}.zip", kExtensionId, BRDFC_VERSION);
  write_zip(staging.path() / zip_name, members);

  result.folder = options.out / kExtensionId;
  result.zip = options.out / zip_name;
  replace_folder(folder, result.folder, staging.path() / "old");
  fs::rename(staging.path() / zip_name, result.zip);
  if (options.progress) options.progress("done", int(chosen.size()), int(chosen.size()));
  return result;
}

}  // namespace brdfc
