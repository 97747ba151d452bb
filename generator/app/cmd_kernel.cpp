// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc kernel: converts a drawn curve to parameters of `lossless`.
#include <fstream>

#include "app/commands.h"
#include "app/numbers.h"
#include "core/csv.h"
#include "measure/kernel_fit.h"

namespace brdfc::app {
namespace {

measure::KernelCurve read_curve(const std::string& path) {
  std::ifstream file(path);
  if (!file) input_error("{}: expected a CSV file with the header u,k that can be read", path);
  CsvReader in(file, path, {"u", "k"});
  if (in.empty()) input_error("{}: expected a CSV file with the header u,k", path);
  measure::KernelCurve curve;
  std::vector<double> row;
  while (in.next(row)) {
    if (!(row[0] >= 0)) input_error("{}: u: expected a distance of at least 0, got {}", in.where(), row[0]);
    if (!curve.u.empty() && !(row[0] > curve.u.back()))
      input_error("{}: u: expected more than {}, the distance before, got {}", in.where(), curve.u.back(), row[0]);
    if (!(row[1] > 0)) input_error("{}: k: expected a height above 0, got {}", in.where(), row[1]);
    curve.u.push_back(row[0]);
    curve.k.push_back(row[1]);
  }
  if (curve.u.size() < 2) input_error("{}: expected at least two points, got {}", path, curve.u.size());
  return curve;
}

}  // namespace

void add_kernel_command(Command app) {
  struct Options {
    std::string file;
    double n = 0;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "kernel",
      "Parameters of the model lossless for a drawn kernel k(u), u = n |x' - y'|: the four heights and the glossiness\n"
      "with the smallest error.\n"
      "FILE:   CSV with header u,k: distances >= 0, increasing, and heights > 0, at least two points; the kernel is\n"
      "        linear between them and constant outside\n"
      "stdout: n=... kernel=table h0=... h1=... h2=... h3=..., as other commands take them\n"
      "stderr: largest relative difference of the kernel, and relative L1 of f cos");
  cmd.add_option("file", o->file, "The curve").required();
  const ParamInfo& n = *find_model("lossless").info().param("n");
  o->n = n.value[0];
  add_number(cmd, "--n", o->n, {0, n.max, true}, "Glossiness for which the curve is drawn").capture_default_str();
  cmd.callback([o] {
    const measure::KernelFit fit = measure::fit_kernel(read_curve(o->file), o->n);
    std::string line;
    for (const char* name : {"n", "kernel", "h0", "h1", "h2", "h3"}) {
      const ParamValue& value = fit.values.at(name);
      const auto* number = std::get_if<double>(&value);
      line += fmt::format("{}{}={}", line.empty() ? "" : " ", name,
                          number ? fmt::format("{}", *number) : std::get<std::string>(value));
    }
    fmt::print("{}\n", line);
    fmt::print(stderr,
               "brdfc kernel: largest relative difference of the kernel {:.2e}; relative L1 of f cos {:.2e}, from one "
               "view at most {:.2e}\n",
               fit.kernel, fit.l1, fit.l1_view);
  });
}

}  // namespace brdfc::app
