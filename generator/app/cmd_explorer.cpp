// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc explorer: writes the page that draws the models in a browser.
#include <filesystem>
#include <iostream>

#include "app/commands.h"
#include "core/data_dir.h"
#include "pack/explorer.h"
#include "pack/target.h"
#include "reference/color.h"

namespace brdfc::app {
namespace {

namespace fs = std::filesystem;

void write_explorer(const fs::path& out) {
  pack::require_explorer(out);
  // Not the configuration in $OCIO: the page's colours are linear Rec.709.
  const reference::ColorConfig config(data_path("data/color/config.ocio"));
  const auto files = pack::explorer_page(models_named(""), data_path("explorer"), config.to_rec709());
  pack::replace_content(out, files);
  std::cerr << "brdfc explorer: open " << (out / "index.html").string() << " in a browser\n";
}

}  // namespace

void add_explorer_command(Command app) {
  auto out = std::make_shared<std::string>();
  const Command cmd =
      app.add_subcommand("explorer",
                         "Writes a page that shows all models in a browser, from their formulas: curves,\n"
                         "albedo, lit spheres, differences. It needs WebGL 2, but no server or network.");
  cmd.add_option("--out", *out, "Folder for the page; open its index.html").required();
  cmd.callback([out] { write_explorer(*out); });
}

}  // namespace brdfc::app
