// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc stability: tests rounding, invalid values and sampling for as long as asked.
#include <algorithm>
#include <chrono>
#include <limits>

#include "app/commands.h"
#include "app/numbers.h"
#include "measure/stability.h"
#include "report/stability_maps.h"

namespace brdfc::app {

void add_stability_command(Command app) {
  struct Options {
    std::string model, maps;
    measure::Hunt hunt;
    long calls = 1000000;
    double limit = 32;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "stability",
      "Compares, over all parameters that models accept, double precision with 113 bits, and float and recorded\n"
      "programs with double. Searches for invalid values (NaN, infinite, negative). Exit status 1 if a test fails.");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`; all models if omitted");
  add_number(cmd, "--points", o->hunt.points, {.low = 1}, "Points per model at which double is compared with 113 bits");
  add_number(cmd, "--calls", o->calls, {.low = 0},
             "Evaluations and samples, over all models, to search for invalid values");
  add_number(cmd, "--limit", o->limit, {.low = 0},
             "Rounding that a formula may add to that of its inputs, in units of epsilon");
  cmd.add_option("--maps", o->maps,
                 "Folder for maps of the errors of these models, and maps.json, which describes them");
  add_number(cmd, "--seed", o->hunt.seed, {}, "Seed of parameters and directions");
  cmd.callback([o] {
    const std::vector<const Model*> chosen = models_named(o->model);
    int failed = 0;
    for (const Model* m : chosen) {
      fmt::print(stderr, "{} ...\n", m->info().name);
      const auto start = std::chrono::steady_clock::now();
      const measure::Stability s = measure::hunt_rounding(*m, o->hunt);
      const double hunted = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const long calls = measure::evaluate_everywhere(*m, o->calls / long(chosen.size()), o->hunt.seed);
      fmt::print("{}: {} places, {:.3g} units at {}\n  largest relative error {:.2g} at {}\n  {} calls, no bad value\n",
                 m->info().name, s.points, s.amplified, s.amplified_where, s.relative, s.where, calls);
      if (s.amplified > o->limit) ++failed, fmt::print("  FAILED: expected at most {:g} units\n", o->limit);
      for (const auto& [decade, row] : measure::single_precision_by_decade(*m, 200, 200, o->hunt.seed))
        fmt::print("  numbers from 1e{}: float {:.2g}, recorded {:.2g}, rounded directions alone {:.2g}\n", decade,
                   row.native, row.recorded, row.inherent);
      fmt::print("  {:.1f} s, {:.1f} s of them for rounding\n",
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), hunted);
    }
    if (!o->maps.empty()) {
      report::write_stability_maps(o->maps, chosen);
      fmt::print(stderr, "wrote {}/maps.json and its pictures\n", o->maps);
    }
    std::fflush(stdout);
    if (failed > 0) throw CheckFailed(fmt::format("{} models lose digits", failed));
  });
}

}  // namespace brdfc::app
