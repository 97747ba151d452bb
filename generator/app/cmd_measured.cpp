// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc measured: what a file with a measured BRDF holds and lacks, and which models come close to it.
#include <algorithm>
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "app/numbers.h"
#include "core/csv.h"
#include "core/json_text.h"
#include "core/text.h"
#include "measured/findings.h"
#include "measured/fit_lobes.h"
#include "measured/fit_models.h"
#include "reference/color.h"

namespace brdfc::app {
namespace {

using Json = nlohmann::ordered_json;

Json rgb(const Rgb<double>& c) { return {c.r, c.g, c.b}; }

std::vector<const Model*> models_of(const std::vector<std::string>& names) {
  if (names == std::vector<std::string>{"none"}) return {};
  if (names == std::vector<std::string>{"all"}) return models_named("");
  std::vector<const Model*> out;
  for (const std::string& name : names) {
    out.push_back(&find_model(name));
    if (!out.back()->has_scatter())
      input_error("--models: {} is a mirror alone, which no measured BRDF shows: expected another", name);
  }
  return out;
}

Json parameters_of(const ParamValues& values) {
  Json out = Json::object();
  for (const auto& [name, value] : values) out[name] = std::visit([](const auto& v) { return Json(v); }, value);
  return out;
}

Json describe(const measured::ModelFit::Turned& t) {
  return {{"angle", t.angle},
          {"error", t.error},
          {"parameters", parameters_of(t.values)},
          {"matte", t.matte ? rgb(*t.matte) : Json()}};
}

Json describe(const measured::ModelFit& f) {
  return {{"model", f.model->info().name},
          {"parameters", parameters_of(f.values)},
          {"matte", f.matte ? rgb(*f.matte) : Json()},
          {"error", f.error},
          {"mirror", f.mirror},
          {"stopped", f.stopped},
          {"turned", f.turned ? describe(*f.turned) : Json()},
          {"seconds", f.seconds}};
}

Json describe(const measured::LobeSum& sum) {
  Json lobes = Json::array();
  for (std::size_t i = 0; i < sum.lobes.size(); ++i)
    lobes.push_back({{"model", sum.lobes[i].model->info().name},
                     {"parameters", parameters_of(sum.lobes[i].values)},
                     {"share", sum.share[i]}});
  return {{"error", sum.error},
          {"lobes", lobes},
          {"brightest", {{"albedo", sum.brightest.albedo}, {"degrees", sum.brightest.degrees}}},
          {"seconds", sum.seconds}};
}

void print_sums(const std::vector<measured::LobeSum>& sums, int asked) {
  if (sums.empty()) {
    fmt::print("\n  black: there is nothing of which lobes could be a sum\n");
    return;
  }
  fmt::print("\n  {:>5}{:>12}  {:>6}  lobes\n", "lobes", "error", "time");
  for (const measured::LobeSum& sum : sums) {
    std::vector<std::string> names;
    for (const measured::Lobe& lobe : sum.lobes) names.push_back(lobe.model->info().name);
    fmt::print("  {:>5}{:>10.2f} %  {:>4.1f} s  {}\n", sum.lobes.size(), 100 * sum.error, sum.seconds,
               join(names, " + "));
  }
  const measured::LobeSum& last = sums.back();
  if (last.lobes.size() < std::size_t(asked)) fmt::print("  another lobe hardly makes the error smaller\n");
  fmt::print("\n  {:>8}  lobe\n", "of light");
  for (std::size_t i = 0; i < last.lobes.size(); ++i) {
    const ModelInfo& info = last.lobes[i].model->info();
    fmt::print("  {:>6.2f} %  {} {}\n", 100 * last.share[i], info.name,
               format_values(info, measured::rounded(last.lobes[i].values)));
  }
  if (const auto said = measured::gain_of_sum(last.brightest)) fmt::print("  {}\n", *said);
}

/// f and pdf for pairs of directions from stdin.
void print_pairs(const Brdf<double>& brdf) {
  CsvReader in(std::cin, "stdin", {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"});
  if (in.empty()) input_error("stdin: expected a CSV table with the header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z");
  CsvWriter out("f_r,f_g,f_b,pdf");
  std::vector<double> row;
  while (in.next(row)) {
    const Vec3<double> wi = in.unit_vector(row, 0), wo = in.unit_vector(row, 3);
    const Rgb<double> f = brdf.eval(wi, wo);
    out.row({f.r, f.g, f.b, brdf.pdf(wi, wo)});
  }
  out.flush();
}

}  // namespace

void add_measured_command(Command app) {
  struct Options {
    std::string file;
    bool json = false, pairs = false;
    std::vector<std::string> models{"all"};
    std::vector<double> at{0, 15, 30, 45, 60, 75, 89};
    bool no_matte = false;
    std::optional<int> lobes;
    std::vector<std::string> from;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "measured",
      "Reads a measured BRDF. Prints its format, its gaps and its albedo, and fits every model to it: a table of the\n"
      "models, the best first, with parameters and error, the fraction of the light that is reflected in other\n"
      "directions. FILE is from MERL (.binary), RGL (.bsdf), UTIA (.bin), ALTA as text (.alta, .dat) or Radiance\n"
      "(.xml), or a table (.csv) with the columns theta_i,phi_i,theta_o,phi_o in degrees (theta_i_rad,... in\n"
      "radians), or wi_x,wi_y,wi_z,wo_x,wo_y,wo_z, and r,g,b in 1/sr, with one row for each combination of angles.\n"
      "Colours are linear Rec.709.");
  cmd.add_option("file", o->file, "The file").required();
  cmd.add_flag("--json", o->json, "Print JSON");
  cmd.add_option("--models", o->models, "Names of the models to fit, separated by commas; all, or none")
      .delimiter(',')
      .capture_default_str();
  const Option lobes =
      add_number(cmd, "--lobes", o->lobes, {1, kMostLobes},
                 "Fit sums of 1, 2, ... up to this number of lobes, each with its error. Models are then fitted\n"
                 "only if --models names them");
  cmd.add_option("--from", o->from,
                 "Names of the models that may be in a sum, separated by commas; by default all that can")
      .delimiter(',')
      .needs(lobes);
  cmd.add_flag("--no-matte", o->no_matte, "Fit the models only, without an additional Lambert surface");
  add_numbers(cmd, "--at", o->at, {0, 90, false, 0, "degrees from 0 to 89.9"},
              "View angles for the albedo: degrees from the normal, separated by commas (default: 0, 15, 30, ... 89)");
  cmd.add_flag(
         "--pairs", o->pairs,
         "Instead print the BRDF in 1/sr for pairs of directions, and the pdf of the reference renderer's samples.\n"
         "stdin:  CSV with header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z (unit vectors)\n"
         "stdout: CSV with header f_r,f_g,f_b,pdf")
      .excludes("--json")
      .excludes("--models")
      .excludes("--lobes")
      .excludes("--from")
      .excludes("--no-matte")
      .excludes("--at");
  cmd.callback([o, cmd] {
    if (o->lobes && cmd.count("--models") == 0) o->models = {"none"};
    if (o->from == std::vector<std::string>{"all"}) o->from.clear();
    const auto start = std::chrono::steady_clock::now();
    const measured::Measurement m = measured::read_measurement(o->file, reference::ColorConfig::current().to_rec709());
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const measured::MeasuredModel model(m);
    if (o->pairs) {
      print_notes(m.notes);
      print_pairs(*model.make_double({}));
      return;
    }
    for (const double degrees : o->at)
      if (degrees > 89.9) input_error("--at: expected degrees from 0 to 89.9, got {:g}", degrees);
    const measured::Findings found = measured::findings(m, model, o->at);
    Json j{{"file", m.file},
           {"format", m.format},
           {"description", m.description},
           {"grid", m.grid},
           {"isotropic", m.isotropic},
           {"highest", m.highest},
           {"seconds", seconds.count()},
           {"notes", m.notes},
           {"lacks", found.sentences},
           {"non_reciprocal", found.non_reciprocal}};
    for (const auto& view : found.views) j["albedo"].push_back({{"degrees", view.degrees}, {"rgb", rgb(view.albedo)}});
    const std::vector<const Model*> models = models_of(o->models);
    const std::vector<measured::LobeKind> kinds =
        o->lobes ? measured::lobe_kinds(o->from, m.isotropic) : std::vector<measured::LobeKind>{};
    const std::size_t steps = models.size() + (o->lobes ? measured::lobe_steps(std::size_t(*o->lobes)) : 0);
    const auto progress = [&](const Model& last, std::size_t done) {
      fmt::print(stderr, "brdfc measured: {}/{} {}\n", done, steps, last.info().name);
    };
    const auto fits =
        measured::fit_models(m, model, models, o->no_matte ? measured::Matte::None : measured::Matte::Added, progress);
    j["fits"] = Json::array();
    for (const measured::ModelFit& f : fits) j["fits"].push_back(describe(f));
    std::vector<measured::LobeSum> sums;
    if (o->lobes) {
      sums = measured::fit_lobes(m, model, kinds, std::size_t(*o->lobes), [&](std::size_t done) {
        fmt::print(stderr, "brdfc measured: {}/{} lobes\n", models.size() + done, steps);
      });
      j["sums"] = Json::array();
      for (const measured::LobeSum& sum : sums) j["sums"].push_back(describe(sum));
    }
    if (o->json) {
      fmt::print("{}\n", json_text(j, 1));
      return;
    }
    fmt::print("{}  {}, {}\n", m.file, m.format, m.isotropic ? "isotropic" : "anisotropic");
    if (!m.description.empty()) fmt::print("  {}\n", m.description);
    fmt::print("  {}, read in {:.2f} s\n", m.grid, seconds.count());
    for (const auto& view : found.views)
      fmt::print("  reflects, seen at {:2g} degrees  {:.4f} {:.4f} {:.4f}\n", view.degrees, view.albedo.r,
                 view.albedo.g, view.albedo.b);
    for (const auto* sentences : {&m.notes, &found.sentences})
      for (const std::string& sentence : *sentences) fmt::print("  {}\n", sentence);
    if (!fits.empty()) fmt::print("\n  {:<22}{:>10}  {:>6}  parameters\n", "model", "error", "time");
    for (const measured::ModelFit& f : fits)
      fmt::print("  {:<22}{:>8.2f} %  {:>4.1f} s  {}{}\n", f.model->info().name, 100 * f.error, f.seconds,
                 format_values(f.model->info(), measured::rounded(f.values)),
                 (f.matte ? fmt::format(" and Lambert {:.4g},{:.4g},{:.4g}", f.matte->r, f.matte->g, f.matte->b) : "") +
                     (measured::has_mirror(f)
                          ? fmt::format("; its mirror, {} % of a white world, is not in the data", in_percent(f.mirror))
                          : "") +
                     measured::remarks(f));
    if (const auto why = measured::order_of_fits(fits)) fmt::print("  {}\n", *why);
    if (o->lobes) print_sums(sums, *o->lobes);
  });
}

}  // namespace brdfc::app
