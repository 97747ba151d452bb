// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc check: tests the properties that models declare.
#include <chrono>
#include <nlohmann/json.hpp>

#include "app/commands.h"
#include "app/numbers.h"
#include "check/check.h"
#include "core/json_text.h"
#include "measure/properties.h"

namespace brdfc::app {

void add_check_command(Command app) {
  struct Options {
    std::string model;
    bool all = false, json = false, markdown = false;
    check::Options check;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "check",
      "Tests the properties that models declare (energy, reciprocity, isotropy, positive values, smoothness, limits;\n"
      "also that declared failures occur), and those that every model must have (sampling according to the pdf, exact\n"
      "closures, small rounding errors in float and double), at default, random and extreme parameters. For all "
      "models\n"
      "it then prints a table of properties. A check that does not apply to a model is skipped, with the reason. Exit\n"
      "status 1 if a check fails.");
  const Option model = cmd.add_option("model", o->model, "Model, as in `brdfc list`; all models if omitted");
  cmd.add_flag("--all", o->all, "All models, as if no model is given").excludes(model);
  const Option json = cmd.add_flag(
      "--json", o->json, "Print JSON: an array with one object per row; passed is null if the check was skipped");
  cmd.add_flag("--markdown", o->markdown, "Print only the table of properties of all models, as Markdown")
      .excludes(model)
      .excludes(json);
  add_number(cmd, "--effort", o->check.effort, {0.01, 1000}, "Scales the numbers of cases, directions and samples");
  add_number(cmd, "--seed", o->check.seed, {}, "Seed of the random parameters and directions");
  cmd.callback([o] {
    if (o->markdown) {
      fmt::print("{}", measure::property_table(true));
      return;
    }
    const std::vector<const Model*> chosen = models_named(o->model);

    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    int failed = 0;
    for (const Model* m : chosen) {
      fmt::print(stderr, "checking {} ...\n", m->info().name);
      const auto start = std::chrono::steady_clock::now();
      const std::vector<check::Row> rows = check::check_model(*m, o->check);
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (!o->json)
        fmt::print("{} ({:.1f} s)\n  {:<18} {:>6} {:>7} {:>11} {:>11}  {:<7}  {}\n", m->info().name, seconds, "check",
                   "cases", "skipped", "worst", "limit", "result", "expected");
      for (const check::Row& r : rows) {
        const bool skipped = r.result == check::Result::Skipped;
        failed += r.result == check::Result::Failed ? 1 : 0;
        if (o->json) {
          const nlohmann::ordered_json passed =
              skipped ? nlohmann::ordered_json() : nlohmann::ordered_json(r.result == check::Result::Passed);
          all.push_back({{"model", r.model},
                         {"check", r.check},
                         {"expected", r.expected},
                         {"cases", r.cases},
                         {"skipped", r.skipped},
                         {"worst", r.worst},
                         {"limit", r.limit},
                         {"passed", passed},
                         {"where", r.where},
                         {"reason", r.reason},
                         {"declare", r.declare}});
          continue;
        }
        if (skipped) {
          fmt::print("  {:<18} {:>6} {:>7} {:>11} {:>11}  {:<7}  {}\n", r.check, "-", "-", "-", "-", "skipped",
                     r.reason);
          continue;
        }
        fmt::print("  {:<18} {:>6} {:>7} {:>11.4g} {:>11.4g}  {:<7}  {}\n", r.check, r.cases, r.skipped, r.worst,
                   r.limit, r.result == check::Result::Passed ? "ok" : "FAILED", r.expected);
        if (r.result == check::Result::Failed) fmt::print("    at {}\n", r.where);
        if (!r.declare.empty()) fmt::print("    say {} if that is meant\n", r.declare);
      }
    }
    if (o->json) fmt::print("{}\n", json_text(all, 2));
    if (!o->json && o->model.empty()) fmt::print("\n{}", measure::property_table(false));
    std::fflush(stdout);
    if (failed > 0) throw CheckFailed(fmt::format("{} of the declared properties failed", failed));
  });
}

}  // namespace brdfc::app
