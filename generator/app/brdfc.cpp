// SPDX-License-Identifier: GPL-3.0-or-later
// The command line. Exit status: 0; 1 if a check failed or a model returned an invalid value; 2 for wrong usage or
// input.
#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <new>
#include <system_error>

#include "app/commands.h"
#include "core/error.h"

int main(int argc, char** argv) {
  CLI::App app{"brdfc compiles reflection models into a Blender extension and renders their reference images."};
  app.name("brdfc");
  app.set_version_flag("--version", BRDFC_VERSION);
  app.require_subcommand(1);
  try {
    brdfc::app::add_list_command(app);
    brdfc::app::add_eval_command(app);
    brdfc::app::add_closure_command(app);
    brdfc::app::add_probe_command(app);
    brdfc::app::add_sample_command(app);
    brdfc::app::add_albedo_command(app);
    brdfc::app::add_kernel_command(app);
    brdfc::app::add_optical_command(app);
    brdfc::app::add_measured_command(app);
    brdfc::app::add_check_command(app);
    brdfc::app::add_stability_command(app);
    brdfc::app::add_fit_command(app);
    brdfc::app::add_base_command(app);
    brdfc::app::add_build_command(app);
    brdfc::app::add_python_command(app);
    brdfc::app::add_explorer_command(app);
    brdfc::app::add_render_command(app);
    brdfc::app::add_scene_command(app);
    brdfc::app::add_compare_command(app);
    brdfc::app::add_report_command(app);
    brdfc::app::add_where_command(app);
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    const auto is_named = [&](const CLI::App* command) { return command->get_name() == argv[1]; };
    if (argc > 1 && argv[1][0] != '-' && app.get_subcommands(is_named).empty()) {
      fmt::print(stderr, "brdfc: unknown command '{}': see brdfc --help\n", argv[1]);
      return 2;
    }
    fmt::print(stderr, "brdfc: {}\n", e.what());
    return 2;
  } catch (const brdfc::InputError& e) {
    fmt::print(stderr, "brdfc: {}\n", e.what());
    return 2;
  } catch (const std::system_error& e) {
    // A file or pipe that the system can't read or write; models are not the cause.
    fmt::print(stderr, "brdfc: {}\n", e.what());
    return 2;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "brdfc: out of memory: this takes more than the machine, or a limit set on it, has left\n");
    return 1;
  } catch (const std::exception& e) {
    fmt::print(stderr, "brdfc: {}\n", e.what());
    return 1;
  }
}
