// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "app/commands.h"
#include "reference/image.h"

namespace brdfc {

void add_compare_command(CLI::App& app) {
  struct Options {
    std::string a, b, diff;
    bool json = false;
    double scale = 0.25;
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("compare", "Error of picture A against the reference picture B");
  command->add_option("A", options->a, "EXR to judge")->required();
  command->add_option("B", options->b, "EXR taken as truth")->required();
  command->add_flag("--json", options->json, "Print JSON instead of a table");
  command->add_option("--diff", options->diff,
                      "Write the difference as PNG: red where A is brighter, blue where darker");
  command->add_option("--diff-scale", options->scale, "Difference shown in full colour, relative to the mean of B")
      ->check(CLI::Range(1e-9, 1e9))
      ->capture_default_str();
  command->callback([options] {
    const Rendering a = read_rendering(options->a), b = read_rendering(options->b);
    const Comparison c = compare(a, b, options->a, options->b);
    if (!options->diff.empty()) write_display(options->diff, difference_image(a.mean, b.mean, options->scale));
    if (options->json) {
      fmt::print("{}\n", to_json(c).dump(2));
      return;
    }
    fmt::print("relMSE     {:.6g}\nMSE        {:.6g}\nmean A     {:.6g}\nmean B     {:.6g}\nbias       {:.6g}\n",
               c.rel_mse, c.mse, c.mean_a, c.mean_b, c.bias);
    fmt::print("max        {:.6g} at pixel ({}, {})\n", c.max, c.max_x, c.max_y);
    if (c.noise_mse) fmt::print("noise MSE  {:.6g}\n", *c.noise_mse);
  });
}

}  // namespace brdfc
