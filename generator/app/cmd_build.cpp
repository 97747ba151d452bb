// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <memory>
#include <set>

#include "app/commands.h"
#include "pack/pack.h"
#include "reference/scene.h"

namespace brdfc {
namespace {

struct Options {
  bool all = false;
  std::string scene, out, addon = BRDFC_SOURCE_DIR "/blender_addon";
  std::vector<std::string> models;
};

void print_table(const PackResult& result) {
  fmt::print("{:<20} {:<8} {:>8} {:>6} {:>10} {:>11} {:>11} {:>12} {:>11} {:>8}\n", "model", "form", "closures",
             "slots", "operations", "relative_l1", "albedo", "table_floats", "table_error", "bytes");
  for (const PackLine& l : result.lines)
    fmt::print("{:<20} {:<8} {:>8} {:>6} {:>10} {:>11} {:>11.2e} {:>12} {:>11.2e} {:>8}\n", l.model, l.representation,
               l.closures, l.slots, l.operations,
               l.error.relative_l1 ? fmt::format("{:.2e}", *l.error.relative_l1) : "expectation", l.error.albedo,
               l.table_floats, l.table_error, l.bytes);
}

void run(const Options& options) {
  if (int(options.all) + int(!options.scene.empty()) + int(!options.models.empty()) != 1)
    input_error("build: expected one of --all, --scene FILE or --model NAME");
  PackOptions pack{options.out, options.addon, options.models, {}};
  if (!options.scene.empty()) {
    // Only the models that the scene's materials name.
    const Scene scene = load_scene(options.scene);
    std::set<std::string> used;
    for (const Material& m : scene.materials) used.insert(m.model->info().name);
    pack.models.assign(used.begin(), used.end());
  }
  const auto start = std::chrono::steady_clock::now();
  pack.progress = [&](const std::string& what, int done, int total) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fmt::print(stderr, "brdfc build: {}/{} {:<20} {:6.1f} s\n", done, total, what, seconds);
  };
  const PackResult result = build_pack(pack);
  print_table(result);
  fmt::print(stderr, "brdfc build: wrote {} and {}\n", result.zip.string(), result.folder.string());
}

}  // namespace

void add_build_command(CLI::App& app) {
  auto options = std::make_shared<Options>();
  CLI::App* c = app.add_subcommand("build", "Write the Blender extension");
  c->add_flag("--all", options->all, "Every model");
  c->add_option("--scene", options->scene, "Only the models of a scene file");
  c->add_option("--model", options->models, "Only these models (repeat for several)");
  c->add_option("--out", options->out, "Folder for the extension and its zip")->required();
  c->add_option("--addon", options->addon, "Folder with the add-on's Python");
  c->callback([options] { run(*options); });
}

}  // namespace brdfc
