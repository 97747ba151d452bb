// SPDX-License-Identifier: GPL-3.0-or-later
// One function per subcommand. Each adds its subcommand to the application and sets its callback. The callback throws
// InputError (exit status 2) or ValueError / CheckFailed (exit status 1). Tables go to stdout, messages to stderr.
//
// Commands declare their options with the classes below, and command_line.cpp alone includes CLI11, whose headers take
// longer to compile than most commands do. The functions are CLI11's functions of the same names, which document them.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace brdfc::app {

/// A check ran and failed. Exit status 1.
struct CheckFailed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Prints notes about the input, what was assumed and what was left out, to stderr.
inline void print_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) fmt::print(stderr, "brdfc: {}\n", note);
}

/// An option or argument of a command.
class Option {
 public:
  explicit Option(CLI::Option* option) : option_(option) {}

  Option required() const;
  Option group(const std::string&) const;
  Option excludes(Option) const;
  Option excludes(const std::string& name) const;
  Option needs(Option) const;
  Option expected(int number) const;
  Option expected(int low, int high) const;
  Option delimiter(char) const;
  Option type_name(const std::string&) const;
  Option capture_default_str() const;
  Option default_function(const std::function<std::string()>&) const;
  /// CLI11's check(IsMember()).
  Option is_member(const std::vector<std::string>&) const;

 private:
  CLI::Option* option_;
};

/// The application, or one of its commands.
class Command {
 public:
  explicit Command(CLI::App* command) : command_(command) {}

  Command add_subcommand(const std::string& name, const std::string& doc) const;
  Option add_option(const std::string& name, std::string&, const std::string& doc) const;
  Option add_option(const std::string& name, std::vector<std::string>&, const std::string& doc) const;
  Option add_option_function(const std::string& name, const std::function<void(const std::string&)>&,
                             const std::string& doc) const;
  Option add_option_function(const std::string& name, const std::function<void(const std::vector<std::string>&)>&,
                             const std::string& doc) const;
  Option add_flag(const std::string& name, bool&, const std::string& doc) const;
  void callback(const std::function<void()>&) const;
  /// How many values were given for an option.
  std::size_t count(const std::string& name) const;

 private:
  CLI::App* command_;
};

/// Says that a value of an option is not what is expected. Exit status 2.
[[noreturn]] void refuse(const std::string& option, const std::string& message);

/// Parses the command line and runs the command that it names. Returns the exit status: 0; 1 if a check failed or a
/// model returned an invalid value; 2 for wrong usage or input.
int run_command_line(int argc, char** argv);

void add_list_command(Command);
void add_where_command(Command);
void add_eval_command(Command);
void add_closure_command(Command);
void add_probe_command(Command);
void add_sample_command(Command);
void add_albedo_command(Command);
void add_kernel_command(Command);
void add_optical_command(Command);
void add_measured_command(Command);
void add_check_command(Command);
void add_stability_command(Command);
void add_fit_command(Command);
void add_base_command(Command);
void add_build_command(Command);
void add_python_command(Command);
void add_explorer_command(Command);
void add_render_command(Command);
void add_scene_command(Command);
void add_compare_command(Command);
void add_report_command(Command);

}  // namespace brdfc::app
