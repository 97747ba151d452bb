// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <memory>

#include "app/commands.h"
#include "report/report.h"

namespace brdfc::app {

void add_report_command(Command app) {
  const Command command = app.add_subcommand(
      "report",
      "Write index.html, report.json and report.csv about the scenes rendered in the folders of DIR. Includes the\n"
      "tables that the closure tests write to conformance/ beside DIR");
  const auto folder = std::make_shared<std::string>();
  command.add_option("DIR", *folder, "A folder with one folder per scene, each with a runs.json").required();
  command.callback([folder] {
    for (const auto& scene : report::not_rendered(*folder))
      fmt::print(stderr, "brdfc: {}: left out, it was not rendered: it has no runs.json\n", scene.string());
    const std::vector<report::SceneReport> scenes = report::write_report(*folder);
    fmt::print(stdout, "{}", report::report_csv(scenes));
    fmt::print(stderr, "wrote {}/index.html, report.json and report.csv\n", *folder);
  });
}

}  // namespace brdfc::app
