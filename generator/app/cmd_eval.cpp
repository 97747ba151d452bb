// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc eval: the BRDF and its pdf for pairs of directions.
#include <iostream>

#include "app/commands.h"
#include "core/csv.h"
#include "measure/bound_model.h"

namespace brdfc::app {

void add_eval_command(Command app) {
  struct Options {
    std::string model;
    std::vector<std::string> values;
  };
  auto o = std::make_shared<Options>();
  const Command cmd =
      app.add_subcommand("eval",
                         "BRDF (1/sr, no cosine, no delta terms) and pdf (per solid angle) for pairs of directions.\n"
                         "stdin:  CSV with header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z (unit vectors, z is the normal)\n"
                         "stdout: CSV with header f_r,f_g,f_b,pdf");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`").required();
  cmd.add_option("values", o->values, "Parameters as name=value; a colour is r,g,b or one number");
  cmd.callback([o] {
    const Model& model = find_model(o->model);
    const measure::BoundModel bound = measure::bind_model(model, parse_values(model.info(), o->values));
    CsvReader in(std::cin, "stdin", {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"});
    if (in.empty()) input_error("stdin: expected a CSV table with the header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z");
    CsvWriter out("f_r,f_g,f_b,pdf");
    std::vector<double> row;
    while (in.next(row)) {
      const Vec3<double> wi = in.unit_vector(row, 0), wo = in.unit_vector(row, 3);
      const Rgb<double> f = bound.brdf->eval(wi, wo);
      const double pdf = bound.brdf->pdf(wi, wo);
      const std::string label = in.where() + ": " + bound.label;
      measure::require_value(f, "f", label, wi, wo);
      measure::require_value(pdf, "pdf", label, wi, wo);
      out.row({f.r, f.g, f.b, pdf});
    }
    out.flush();
  });
}

}  // namespace brdfc::app
