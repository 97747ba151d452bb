// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc measured: what a file with a measured BRDF holds and lacks.
#include <chrono>
#include <iostream>
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "core/csv.h"
#include "measured/findings.h"
#include "reference/color.h"

namespace brdfc::app {
namespace {

using Json = nlohmann::ordered_json;

/// X, Y and Z to linear Rec.709, whatever the working space is.
ToRgb to_rec709() {
  auto config =
      std::make_shared<reference::ColorConfig>(reference::ColorConfig::current().with_working_space("Linear Rec.709"));
  return [config](const Xyz& xyz) { return config->from_xyz(xyz); };
}

Json rgb(const Rgb<double>& c) { return {c.r, c.g, c.b}; }

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
  out.finish();
}

}  // namespace

void add_measured_command(CLI::App& app) {
  struct Options {
    std::string file;
    bool json = false, pairs = false;
  };
  auto o = std::make_shared<Options>();
  CLI::App* cmd = app.add_subcommand(
      "measured",
      "What a file with a measured BRDF holds, what it lacks, and how much light it reflects.\n"
      "FILE is one of the MERL database (.binary), of RGL (.bsdf), of UTIA (.bin), or a table (.csv) with the columns\n"
      "theta_i,phi_i,theta_o,phi_o in degrees, or wi_x,wi_y,wi_z,wo_x,wo_y,wo_z, and r,g,b in 1/sr, a row for every\n"
      "combination of angles. Colours are linear Rec.709.");
  cmd->add_option("file", o->file, "The file")->required();
  cmd->add_flag("--json", o->json, "JSON");
  cmd->add_flag("--pairs", o->pairs,
                "The BRDF in 1/sr for pairs of directions, and the pdf of the reference renderer's samples, instead.\n"
                "stdin:  CSV with header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z (unit vectors)\n"
                "stdout: CSV with header f_r,f_g,f_b,pdf")
      ->excludes("--json");
  cmd->callback([o] {
    const auto start = std::chrono::steady_clock::now();
    const measured::Measurement m = measured::read_measurement(o->file, to_rec709());
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const measured::MeasuredModel model(m);
    if (o->pairs) {
      print_notes(m.notes);
      print_pairs(*model.make_double({}));
      return;
    }
    const measured::Findings found = measured::findings(m, model);
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
    if (o->json) {
      fmt::print("{}\n", j.dump(1));
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
  });
}

}  // namespace brdfc::app
