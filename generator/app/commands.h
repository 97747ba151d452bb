// SPDX-License-Identifier: GPL-3.0-or-later
// One function per subcommand. Each adds its subcommand to the application and sets its callback. The callback throws
// InputError (exit status 2) or ValueError / CheckFailed (exit status 1). Tables go to stdout, messages to stderr.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace brdfc::app {

/// A check ran and failed. Exit status 1.
struct CheckFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Prints notes about the input, what was assumed and what was left out, to stderr.
inline void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) fmt::print(stderr, "brdfc: {}\n", note);
}

void add_list_command(CLI::App&);
void add_where_command(CLI::App&);
void add_eval_command(CLI::App&);
void add_closure_command(CLI::App&);
void add_probe_command(CLI::App&);
void add_sample_command(CLI::App&);
void add_albedo_command(CLI::App&);
void add_kernel_command(CLI::App&);
void add_optical_command(CLI::App&);
void add_measured_command(CLI::App&);
void add_check_command(CLI::App&);
void add_stability_command(CLI::App&);
void add_fit_command(CLI::App&);
void add_base_command(CLI::App&);
void add_build_command(CLI::App&);
void add_python_command(CLI::App&);
void add_explorer_command(CLI::App&);
void add_render_command(CLI::App&);
void add_scene_command(CLI::App&);
void add_compare_command(CLI::App&);
void add_report_command(CLI::App&);

}  // namespace brdfc::app
