// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc python: writes the Python package of models.
#include <filesystem>
#include <iostream>

#include "app/commands.h"
#include "core/data_dir.h"
#include "pack/addon.h"
#include "pack/python_package.h"
#include "pack/target.h"

namespace brdfc::app {
namespace {

namespace fs = std::filesystem;

/// The folder as pip takes it: a name alone would be that of a package of the index, which pip downloads.
std::string for_pip(const fs::path& folder) {
  const std::string text = folder.string();
  return text.find('/') == std::string::npos ? "./" + text : text;
}

void run(const fs::path& out) {
  const fs::path package = out / "brdfc";
  pack::require_package(package);
  pack::make_folder(out);
  const auto files = pack::python_package(models_named(""), data_path("python/brdfc"));
  // Otherwise modules of models that no longer exist would become part of a wheel.
  pack::replace_content(package, files);
  const fs::path project = data_path("python/pyproject.toml");
  std::string text = pack::read_text(project);
  pack::stamp(text, project, "version", pack::quoted("@version@"), pack::quoted(BRDFC_VERSION));
  pack::stamp(text, project, "tool", R"(["brdfc-tool ==@version@"])",
              fmt::format(R"(["brdfc-tool =={}"])", BRDFC_VERSION));
  pack::write_text(out / "pyproject.toml", text);
  pack::write_text(out / "LICENSE", pack::read_text(data_path("LICENSE")));
  std::cerr << "brdfc python: " << files.size() << " modules in " << package.string() << "; `pip install "
            << for_pip(out) << "` installs them, `pip wheel --no-deps " << for_pip(out) << "` makes a wheel of them\n";
}

}  // namespace

void add_python_command(Command app) {
  auto out = std::make_shared<std::string>();
  const Command cmd =
      app.add_subcommand("python",
                         "Writes the Python package `brdfc`: every model's formulas on NumPy arrays, in double\n"
                         "precision, with pyproject.toml. `pip install ./DIR` installs it.");
  cmd.add_option("--out", *out, "Folder for the package").required();
  cmd.callback([out] { run(*out); });
}

}  // namespace brdfc::app
