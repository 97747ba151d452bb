// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc probe: the values that generated code computes, for each step from the model to Cycles.
#include <fmt/format.h>

#include <cstdio>
#include <iostream>

#include "app/commands.h"
#include "core/csv.h"
#include "core/text.h"
#include "pack/probe.h"

namespace brdfc::app {
namespace {

void run_points(const Model& model, const ParamValues& choices) {
  std::vector<std::string> columns = {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z", "u1", "u2", "u3"};
  for (const ParamInfo& p : model.info().params) {
    if (p.kind == ParamKind::Number) columns.push_back(p.name);
    if (p.kind == ParamKind::Color)
      for (const char* c : {"_r", "_g", "_b"}) columns.push_back(p.name + c);
  }
  CsvReader in(std::cin, "stdin", columns);
  if (in.empty()) input_error("stdin: expected a CSV table with the header {}", join(columns, ","));
  std::vector<pack::ProbePoint> points;
  std::vector<double> row;
  while (in.next(row)) {
    ParamValues values = choices;
    std::size_t k = 9;
    for (const ParamInfo& p : model.info().params) {
      if (p.kind == ParamKind::Number) values[p.name] = row[k++];
      if (p.kind == ParamKind::Color) {
        values[p.name] = std::array<double, 3>{row[k], row[k + 1], row[k + 2]};
        k += 3;
      }
    }
    // Checked but not normalised, so that all runs and Cycles get the same numbers.
    in.unit_vector(row, 0);
    in.unit_vector(row, 3);
    points.push_back(
        {complete(model.info(), values), {row[0], row[1], row[2]}, {row[3], row[4], row[5]}, {row[6], row[7], row[8]}});
  }
  const char* const names[] = {"f_r",  "f_g",      "f_b",      "pdf",      "wi_x",      "wi_y",
                               "wi_z", "weight_r", "weight_g", "weight_b", "sample_pdf"};
  std::string out;
  for (pack::ProbeRun run : pack::kProbeRuns)
    for (const char* name : names) out += fmt::format("{}{}_{}", out.empty() ? "" : ",", name_of(run), name);
  out += "\n";
  for (const auto& runs : pack::run_probe(model, choices, points)) {
    for (const pack::ProbeValues& values : runs)
      for (double v : values) out += fmt::format("{:.17g},", std::isfinite(v) ? v : pack::kNotFinite);
    out.back() = '\n';
  }
  if (std::fwrite(out.data(), 1, out.size(), stdout) != out.size()) input_error("stdout: cannot be written");
}

}  // namespace

void add_probe_command(Command app) {
  struct Options {
    std::string model;
    std::vector<std::string> choices;
    bool run = false;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "probe",
      "Prints an OSL shader that shows f, pdf and samples of a model, computed by its recorded formulas. With --run,\n"
      "the tool computes them: in double, in float, as recorded, and as recorded with OSL's arithmetic.\n"
      "stdin of --run:  CSV with header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,u1,u2,u3 and the parameters (colours as\n"
      "                 name_r,name_g,name_b)\n"
      "stdout of --run: CSV of f_r,f_g,f_b,pdf,wi_x,wi_y,wi_z,weight_r,weight_g,weight_b,sample_pdf for each;\n"
      "                 -31337 stands for values that are not finite");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`").required();
  cmd.add_option("choices", o->choices, "Choices as name=value");
  cmd.add_flag("--run", o->run, "Compute the points from stdin");
  cmd.callback([o] {
    const Model& model = find_model(o->model);
    ParamValues choices = parse_values(model.info(), o->choices);
    for (const ParamInfo& p : model.info().params) {
      if (p.kind == ParamKind::Choice) continue;
      choices.erase(p.name);
      for (const std::string& given : o->choices)
        if (given.starts_with(p.name + "="))
          input_error("probe {}: {}: expected only choices, numbers and colours are read from the points", o->model,
                      p.name);
    }
    if (o->run)
      run_points(model, choices);
    else
      fmt::print("{}", pack::probe_source(model, choices));
  });
}

}  // namespace brdfc::app
