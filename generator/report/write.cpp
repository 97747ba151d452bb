// SPDX-License-Identifier: GPL-3.0-or-later
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/json_text.h"
#include "core/text.h"
#include "core/write_beside.h"
#include "reference/image.h"
#include "report/report.h"
#include "report/verdict.h"

namespace brdfc::report {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

template <class T> ordered_json or_null(const std::optional<T>& v) { return v ? ordered_json(*v) : ordered_json(); }

/// The name of a preview; null if there is none.
ordered_json name_or_null(const std::string& name) { return name.empty() ? ordered_json() : ordered_json(name); }

ordered_json form_json(const SceneReport& scene, const FormReport& f, const Previews::Form& previews) {
  ordered_json materials = ordered_json::array();
  for (const MaterialForm& m : f.materials)
    materials.push_back({{"id", m.id},
                         {"model", m.model},
                         {"representation", m.representation},
                         {"closures", m.closures},
                         {"relative_l1", or_null(m.relative_l1)},
                         {"albedo_error", or_null(m.albedo_error)}});
  ordered_json convergence = ordered_json::array(), equal_error = ordered_json::object();
  for (const ConvergencePoint& p : f.convergence)
    convergence.push_back({{"spp", p.spp}, {"noise", p.noise}, {"cpu_seconds", p.cpu_seconds}});
  for (std::size_t i = 0; i < f.equal_error.size(); ++i)
    equal_error[std::to_string(kEqualErrorAt[i])] = or_null(f.equal_error[i]);
  return {{"form", f.form},
          {"label", label(f.form)},
          {"native", is_native(f.form)},
          {"rel_mse", f.difference.rel_mse},
          {"noise_floor", f.difference.noise},
          {"bias", f.difference.bias},
          {"bias_standard_error", f.difference.bias_error},
          {"biased", f.difference.biased()},
          {"differs", differs(f)},
          {"flip", or_null(f.flip)},
          {"test", f.test ? to_json(*f.test) : ordered_json()},
          {"cost", or_null(f.cost)},
          {"pareto", on_front(scene, f)},
          {"equal_error_cost", equal_error},
          {"equal_time", f.equal_time_images > 0
                             ? ordered_json{{"images", f.equal_time_images}, {"rel_mse", f.equal_time.rel_mse}}
                             : ordered_json()},
          {"convergence", convergence},
          {"spp", f.spp},
          {"closures", or_null(f.closures())},
          {"relative_l1", or_null(f.relative_l1())},
          {"cpu_seconds", f.cpu_seconds},
          {"wall_seconds", f.wall_seconds},
          {"images", f.images},
          {"previews",
           {{"picture", previews.picture},
            {"difference", previews.difference},
            {"p_values", name_or_null(previews.p_values)},
            {"equal_time", name_or_null(previews.equal_time)}}},
          {"materials", materials}};
}

ordered_json verdict_json(const Verdict& v) {
  ordered_json cost, worst;
  if (!v.costs.empty()) cost = {{"median", median(v.costs)}, {"least", v.costs.front()}, {"most", v.costs.back()}};
  if (v.worst)
    worst = {{"scene", v.worst_scene->scene},
             {"form", v.worst->form},
             {"bias", v.worst->difference.bias},
             {"bias_standard_error", v.worst->difference.bias_error}};
  return {{"judged", v.judged}, {"same", v.same}, {"costs", v.costs.size()}, {"cost", cost}, {"worst_bias", worst}};
}

/// Per RFC 4180 a field is quoted if it contains a separator, a quote or a line break.
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

void write_text(const fs::path& file, const std::string& text) {
  write_beside(file, [&](const fs::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << text;
    out.close();
    if (!out) input_error("{}: can't be written", file.string());
  });
}

}  // namespace

std::string report_json(const std::vector<SceneReport>& scenes, const std::vector<Previews>& previews) {
  ordered_json out{{"format", 2},
                   {"generator", "brdfc " BRDFC_VERSION},
                   {"rel_mse_epsilon", kRelMseEpsilon},
                   {"shortest_time", kShortestTime},
                   {"equal_error_at", kEqualErrorAt},
                   {"test", {{"significance", kTestSignificance}, {"accepted", kTestAccepted}, {"tile", kTestTile}}},
                   {"verdict", verdict_json(verdict_of(scenes))}};
  ordered_json names = ordered_json::array();
  for (const std::string& form : all_forms(scenes))
    names.push_back({{"form", form}, {"label", label(form)}, {"native", is_native(form)}});
  out["forms"] = std::move(names);
  out["scenes"] = ordered_json::array();
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const SceneReport& s = scenes[i];
    ordered_json forms = ordered_json::array();
    for (std::size_t k = 0; k < s.forms.size(); ++k) forms.push_back(form_json(s, s.forms[k], previews[i].forms[k]));
    const FormReport* by_default = default_form(s);
    out["scenes"].push_back({{"scene", s.scene},
                             {"description", s.description},
                             {"models", models_of(s)},
                             {"settings", {{"width", s.width}, {"height", s.height}, {"max_bounces", s.max_bounces}}},
                             {"reference",
                              {{"image", s.reference_image},
                               {"spp", s.reference_spp},
                               {"wall_seconds", s.reference_seconds},
                               {"preview", previews[i].reference}}},
                             {"exposure", previews[i].exposure},
                             {"difference_scale", previews[i].difference_at},
                             {"default_form", by_default ? ordered_json(by_default->form) : ordered_json()},
                             {"forms", forms},
                             {"provenance", s.provenance},
                             {"commands", s.commands}});
  }
  return json_text(out, 2) + "\n";
}

std::string report_csv(const std::vector<SceneReport>& scenes) {
  const auto number = [](const auto& v) { return v ? fmt::format("{}", *v) : std::string(); };
  const auto equal_error = [&](const FormReport& f) {
    std::vector<std::string> fields(std::size(kEqualErrorAt));
    for (std::size_t i = 0; i < f.equal_error.size(); ++i) fields[i] = number(f.equal_error[i]);
    return join(fields, ",");
  };
  std::string out =
      "scene,form,rel_mse,noise_floor,bias,bias_standard_error,cost,spp,closures,relative_l1,"
      "flip,accepted_pixels,rejected_tiles,equal_error_16,equal_error_256,equal_error_1024\n";
  for (const SceneReport& s : scenes)
    for (const FormReport& f : s.forms)
      out += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_field(s.scene), csv_field(f.form),
                         f.difference.rel_mse, f.difference.noise, f.difference.bias, f.difference.bias_error,
                         number(f.cost), f.spp, number(f.closures()), number(f.relative_l1()), number(f.flip),
                         f.test ? fmt::format("{:.6f},{}", f.test->accepted(), f.test->rejected_tiles) : ",",
                         equal_error(f));
  return out;
}

std::vector<SceneReport> write_report(const fs::path& folder) {
  std::vector<SceneReport> scenes = load_report(folder);
  std::vector<Previews> previews;
  for (const SceneReport& scene : scenes) previews.push_back(write_previews(folder, scene));
  write_text(folder / "report.json", report_json(scenes, previews));
  write_text(folder / "report.csv", report_csv(scenes));
  return scenes;
}

}  // namespace brdfc::report
