// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc where: prints the folder of the tool's data.
#include <fmt/format.h>

#include "app/commands.h"
#include "core/data_dir.h"

namespace brdfc::app {

void add_where_command(CLI::App& app) {
  app.add_subcommand("where",
                     "Prints the folder that stored fits and albedos and the extension's Python are taken from: what\n"
                     "the environment variable BRDFC_DATA names, or share/brdfc beside the program's folder, or the\n"
                     "nearest folder above it that has them, as are the sources that it is built in.")
      ->callback([] { fmt::print("{}\n", data_dir().string()); });
}

}  // namespace brdfc::app
