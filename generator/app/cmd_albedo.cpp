// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc albedo: the directional albedo as a function of the view cosine.
#include <algorithm>
#include <iostream>
#include <optional>

#include "app/commands.h"
#include "app/numbers.h"
#include "core/csv.h"
#include "core/process.h"
#include "measure/albedo.h"
#include "measure/albedo_file.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measure/stored_albedo.h"
#include "measure/tabulate_albedo.h"
#include "tables/store.h"

namespace brdfc::app {

void add_albedo_command(Command app) {
  struct Options {
    std::string model;
    std::vector<std::string> values;
    int count = 0;
    double phi = 0;
    double error = measure::AlbedoOptions().absolute;
    bool store = false;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "albedo",
      "Directional albedo by quadrature: integral of f cos over the light directions plus the weights of ideal\n"
      "reflection and refraction.\n"
      "stdin:  CSV with header cos_theta_o (0 < cos <= 1; negative inside a transmissive model);\n"
      "        without input, 64 cosines from 0.01 to 1\n"
      "stdout: CSV with header cos_theta_o,albedo_r,albedo_g,albedo_b,mirror_r,mirror_g,mirror_b,error_estimate\n"
      "        (the albedo includes ideal reflection and refraction)");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`").required();
  cmd.add_option("values", o->values, "Parameters as name=value; a colour is r,g,b or one number");
  add_number(cmd, "--count", o->count, {2, 1 << 20}, "Number of cosines, from 0.01 to 1; stdin is not read");
  add_number(cmd, "--phi", o->phi, {-7, 7}, "Azimuth of the view direction in radians");
  add_number(cmd, "--error", o->error, {1e-12, 0.1}, "Error to aim at in each channel");
  cmd.add_flag("--store", o->store,
               "Instead makes the table over all parameters that packs use, and replaces the stored one in\n"
               "data/albedos")
      .excludes("values")
      .excludes("--count")
      .excludes("--phi")
      .excludes("--error");
  cmd.callback([o] {
    const Model& model = find_model(o->model);
    if (o->store) {
      if (!measure::has_albedo_table(model)) {
        std::cerr << "brdfc albedo: " << o->model << " has no table: its shader adds the albedo up, or has none\n";
        return;
      }
      const measure::AlbedoTable table = measure::tabulate_albedo(model);
      replace_stored(measure::stored_albedo(model),
                     [&](const std::filesystem::path& path) { measure::write_albedo_exr(table, path); });
      return;
    }
    const measure::BoundModel bound = measure::bind_model(model, parse_values(model.info(), o->values));
    CsvWriter out("cos_theta_o,albedo_r,albedo_g,albedo_b,mirror_r,mirror_g,mirror_b,error_estimate");
    const auto write = [&](double cos_theta_o) {
      const measure::Albedo a = measure::albedo(*bound.brdf, cos_theta_o, o->phi, bound.label, {.absolute = o->error});
      const Rgb<double> t = a.total();
      out.row({cos_theta_o, t.r, t.g, t.b, a.mirror.r, a.mirror.g, a.mirror.b, a.error});
    };
    std::optional<CsvReader> in;
    if (o->count == 0 && !is_terminal(Stream::In))
      in.emplace(std::cin, "stdin", std::vector<std::string>{"cos_theta_o"});
    if (!in || in->empty()) {
      const int n = o->count > 0 ? o->count : 64;
      for (int i = 0; i < n; ++i) {
        write(i + 1 == n ? 1. : 0.01 + 0.99 * i / (n - 1));
        out.flush();
      }
    } else {
      std::vector<double> row;
      while (in->next(row)) {
        const double most = 1 + 1e-6;  // as lengths of directions
        const bool inside = measure::two_sided(model, *bound.brdf) && row[0] < 0 && row[0] >= -most;
        if (!inside && !(row[0] > 0 && row[0] <= most))
          input_error("{}: cos_theta_o: expected a number in (0, 1], got {}", in->where(), row[0]);
        write(std::clamp(row[0], -1., 1.));
      }
    }
    out.flush();
  });
}

}  // namespace brdfc::app
