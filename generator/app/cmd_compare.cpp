// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include "app/commands.h"
#include "app/numbers.h"
#include "core/error.h"
#include "core/json_text.h"
#include "reference/image.h"
#include "report/statistics.h"

namespace brdfc::app {

namespace {

/// Makes a picture brighter or darker throughout. This known bias shows whether a test would detect one.
void inject(reference::Rendering& r, double bias) {
  for (float& v : r.mean.rgb) v = float(v * (1 + bias));
}

/// Writes the images that show why two renderers disagree.
void keep_evidence(const std::filesystem::path& folder, const reference::Rendering& picture,
                   const reference::Rendering& reference, const report::WelchTest& test) {
  reference::write_rendering(folder / "picture.exr", picture);
  reference::write_rendering(folder / "reference.exr", reference);
  reference::write_image(folder / "p-values.exr", test.p);
  reference::write_preview(folder / "picture.png", picture, 0);
  reference::write_preview(folder / "reference.png", reference, 0);
  reference::write_display(folder / "difference.png", reference::difference_image(picture.mean, reference.mean, 0.1));
  reference::write_display(folder / "p-values.png", test.p);
}

}  // namespace

void add_compare_command(Command app) {
  struct Options {
    std::vector<std::string> files;
    std::string diff, keep;
    bool json = false, test = false;
    double scale = 0.25, inject = 0;
  };
  auto options = std::make_shared<Options>();
  const Command command = app.add_subcommand(
      "compare",
      "Error of picture A relative to the reference picture B. With several A, rendered from different seeds, the\n"
      "error of their mean; --test then distinguishes error from noise.");
  command.add_option("A... B", options->files, "One or more EXR files, then the reference EXR")
      .required()
      .expected(1, 1 << 16);
  command.add_flag("--json", options->json, "Print JSON instead of a table");
  command.add_option("--diff", options->diff,
                     "Write the difference as PNG: red where A is brighter, blue where darker");
  add_number(command, "--diff-scale", options->scale, {1e-9, 1e9},
             "Difference shown in full colour, relative to the mean of B")
      .capture_default_str();
  const Option test = command.add_flag(
      "--test", options->test,
      "Welch's t-test per pixel and per tile of 16 x 16, Sidak-corrected at 0.01; exit status 1 unless 99.75 % of the\n"
      "pixels and all tiles are accepted. Needs two A or more, and a B with a variance layer");
  command
      .add_option("--keep", options->keep,
                  "If the test fails, write both pictures, their difference and the p-values to this folder")
      .needs(test);
  add_number(command, "--inject", options->inject, {-1, 1},
             "First brighten A by this fraction, to see whether the test detects it")
      .needs(test);
  command.callback([options] {
    if (options->files.size() < 2)
      input_error("compare: expected one or more pictures and then the reference, got {} alone", options->files[0]);
    const std::string name_a = options->files.front(), name_b = options->files.back();
    std::vector<reference::Rendering> pictures;
    for (std::size_t i = 0; i + 1 < options->files.size(); ++i) {
      pictures.push_back(reference::read_rendering(options->files[i]));
      if (pictures.back().mean.width != pictures.front().mean.width ||
          pictures.back().mean.height != pictures.front().mean.height)
        input_error("{}: expected {} x {} pixels as in {}", options->files[i], pictures.front().mean.width,
                    pictures.front().mean.height, name_a);
    }
    const reference::Rendering b = reference::read_rendering(name_b);
    for (reference::Rendering& picture : pictures) {
      reference::to_working_space_of(picture, b);
      inject(picture, options->inject);
    }
    const reference::Rendering a = report::mean_of(pictures);
    const reference::Comparison c = reference::compare(a, b, name_a, name_b);
    std::optional<report::WelchTest> t;
    if (options->test) {
      if (pictures.size() < 2) input_error("--test: expected at least two pictures and a reference");
      if (!b.variance) input_error("{}: --test needs a variance layer, as `brdfc render` writes", name_b);
      t = report::welch_test(pictures, b, name_a, name_b);
    }
    if (!options->diff.empty())
      reference::write_display(options->diff, reference::difference_image(a.mean, b.mean, options->scale));
    if (t && !t->passed() && !options->keep.empty()) keep_evidence(options->keep, a, b, *t);
    if (options->json) {
      nlohmann::ordered_json out = to_json(c);
      if (t) out["test"] = to_json(*t);
      fmt::print("{}\n", json_text(out, 2));
    } else {
      fmt::print("relMSE     {:.6g}\nMSE        {:.6g}\nmean A     {:.6g}\nmean B     {:.6g}\nbias       {:.6g}\n",
                 c.rel_mse, c.mse, c.mean_a, c.mean_b, c.bias);
      fmt::print("max        {:.6g} at pixel ({}, {})\n", c.max, c.max_x, c.max_y);
      if (c.noise_mse) fmt::print("noise MSE  {:.6g}\n", *c.noise_mse);
      if (t)
        fmt::print(
            "pixels     {:.4f} % of {} accepted, smallest p {:.3g}\ntiles      {} of {} rejected, smallest p {:.3g}\n",
            100 * t->accepted(), t->pixels, t->worst_pixel, t->rejected_tiles, t->tiles, t->worst_tile);
    }
    std::fflush(stdout);
    if (t && !t->passed())
      throw CheckFailed(
          fmt::format("{} differs from {} by more than noise: {} of {} pixels and {} of {} tiles rejected", name_a,
                      name_b, t->rejected_pixels, t->pixels, t->rejected_tiles, t->tiles));
  });
}

}  // namespace brdfc::app
