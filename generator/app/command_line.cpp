// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <system_error>

#include "app/commands.h"
#include "core/error.h"

namespace brdfc::app {

Option Option::required() const { return Option(option_->required()); }
Option Option::group(const std::string& name) const { return Option(option_->group(name)); }
Option Option::excludes(Option other) const { return Option(option_->excludes(other.option_)); }
Option Option::excludes(const std::string& name) const { return Option(option_->excludes(name)); }
Option Option::needs(Option other) const { return Option(option_->needs(other.option_)); }
Option Option::expected(int number) const { return Option(option_->expected(number)); }
Option Option::expected(int low, int high) const { return Option(option_->expected(low, high)); }
Option Option::delimiter(char c) const { return Option(option_->delimiter(c)); }
Option Option::type_name(const std::string& name) const { return Option(option_->type_name(name)); }
Option Option::capture_default_str() const { return Option(option_->capture_default_str()); }
Option Option::default_function(const std::function<std::string()>& f) const {
  return Option(option_->default_function(f));
}
Option Option::is_member(const std::vector<std::string>& names) const {
  return Option(option_->check(CLI::IsMember(names)));
}

Command Command::add_subcommand(const std::string& name, const std::string& doc) const {
  return Command(command_->add_subcommand(name, doc));
}
Option Command::add_option(const std::string& name, std::string& value, const std::string& doc) const {
  return Option(command_->add_option(name, value, doc));
}
Option Command::add_option(const std::string& name, std::vector<std::string>& values, const std::string& doc) const {
  return Option(command_->add_option(name, values, doc));
}
Option Command::add_option_function(const std::string& name, const std::function<void(const std::string&)>& f,
                                    const std::string& doc) const {
  return Option(command_->add_option_function<std::string>(name, f, doc));
}
Option Command::add_option_function(const std::string& name,
                                    const std::function<void(const std::vector<std::string>&)>& f,
                                    const std::string& doc) const {
  return Option(command_->add_option_function<std::vector<std::string>>(name, f, doc));
}
Option Command::add_flag(const std::string& name, bool& value, const std::string& doc) const {
  return Option(command_->add_flag(name, value, doc));
}
void Command::callback(const std::function<void()>& f) const { command_->callback(f); }
std::size_t Command::count(const std::string& name) const { return command_->count(name); }

void refuse(const std::string& option, const std::string& message) { throw CLI::ValidationError(option, message); }

int run_command_line(int argc, char** argv) {
  CLI::App cli{"brdfc compiles reflection models into a Blender extension and renders their reference images."};
  cli.name("brdfc");
  cli.set_version_flag("--version", BRDFC_VERSION);
  cli.require_subcommand(1);
  try {
    const Command app(&cli);
    add_list_command(app);
    add_eval_command(app);
    add_closure_command(app);
    add_probe_command(app);
    add_sample_command(app);
    add_albedo_command(app);
    add_kernel_command(app);
    add_optical_command(app);
    add_measured_command(app);
    add_check_command(app);
    add_stability_command(app);
    add_fit_command(app);
    add_base_command(app);
    add_build_command(app);
    add_python_command(app);
    add_explorer_command(app);
    add_render_command(app);
    add_scene_command(app);
    add_compare_command(app);
    add_report_command(app);
    add_where_command(app);
    cli.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& e) {
    return cli.exit(e);
  } catch (const CLI::ParseError& e) {
    const auto is_named = [&](const CLI::App* command) { return command->get_name() == argv[1]; };
    if (argc > 1 && argv[1][0] != '-' && cli.get_subcommands(is_named).empty()) {
      fmt::print(stderr, "brdfc: unknown command '{}': see brdfc --help\n", argv[1]);
      return 2;
    }
    fmt::print(stderr, "brdfc: {}{}\n", e.what(), argc == 1 ? ": see brdfc --help" : "");
    return 2;
  } catch (const InputError& e) {
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

}  // namespace brdfc::app
