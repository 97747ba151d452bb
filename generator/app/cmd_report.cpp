// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "app/commands.h"
#include "report/report.h"

namespace brdfc::app {

void add_report_command(Command app) {
  const Command command = app.add_subcommand(
      "report",
      "Compares the rendered scenes in the folders of DIR with their references, and writes report.json, report.csv\n"
      "and pictures. script/report makes a page of them");
  const auto folder = std::make_shared<std::string>();
  command.add_option("DIR", *folder, "A folder with one folder per scene, each with a runs.json").required();
  command.callback([folder] {
    for (const auto& scene : report::not_rendered(*folder))
      fmt::print(stderr, "brdfc: {}: left out, it was not rendered: it has no runs.json\n", scene.string());
    const std::vector<report::SceneReport> scenes = report::write_report(*folder);
    fmt::print(stdout, "{}", report::report_csv(scenes));
    fmt::print(stderr, "wrote {}/report.json and report.csv\n", *folder);
  });
}

}  // namespace brdfc::app
