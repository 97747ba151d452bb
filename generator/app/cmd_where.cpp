// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc where: prints the folder of the tool's data.
#include <fmt/format.h>

#include "app/commands.h"
#include "core/data_dir.h"

namespace brdfc::app {

void add_where_command(Command app) {
  app.add_subcommand("where",
                     "Prints the folder with the stored fits and albedos and the extension's Python: the one that the\n"
                     "environment variable BRDFC_DATA names, otherwise share/brdfc beside the program's folder,\n"
                     "otherwise the nearest folder above it that has them, for example the source tree.")
      .callback([] { fmt::print("{}\n", data_dir().string()); });
}

}  // namespace brdfc::app
