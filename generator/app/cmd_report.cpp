// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "app/commands.h"
#include "report/report.h"

namespace brdfc::app {

void add_report_command(CLI::App& app) {
  auto* command = app.add_subcommand(
      "report",
      "Write index.html, report.json and report.csv about the scenes rendered in the folders of DIR, with the\n"
      "tables of conformance/ beside DIR, which the tests of closures write");
  const auto folder = std::make_shared<std::string>();
  command->add_option("DIR", *folder, "A folder with one folder a scene, each holding runs.json")->required();
  command->callback([folder] {
    const std::vector<report::SceneReport> scenes = report::write_report(*folder);
    fmt::print(stdout, "{}", report::report_csv(scenes));
    fmt::print(stderr, "wrote {}/index.html, report.json and report.csv\n", *folder);
  });
}

}  // namespace brdfc::app
