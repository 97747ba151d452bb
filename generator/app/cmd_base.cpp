// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc base: the share of a model that its base covers, and the noise that remains.
#include "app/commands.h"
#include "app/numbers.h"
#include "core/csv.h"
#include "forms/base.h"
#include "measure/bound_model.h"

namespace brdfc::app {

void add_base_command(Command app) {
  struct Options {
    std::string model;
    std::vector<std::string> values;
    std::vector<double> angles = {10, 45, 75, 85};
    double phi = 0;
    int points = 1 << 16;
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "base",
      "Fraction of f cos that the closures of a model's base carry, by view angle. Also the variance of one sampled\n"
      "direction, divided by the squared albedo, in a white world and under a smooth sky: *_drawn if the model is\n"
      "sampled without a base, *_rest if the aimed form samples only the rest.\n"
      "stdout: CSV with header "
      "theta_o,relative_l1,share,best_scale,white_drawn,white_rest,sky_drawn,sky_rest,largest:\n"
      "        the integrals of |f cos - base| and of the base, divided by the albedo; the factor for the base with "
      "the\n"
      "        least variance; the variances; and the largest contribution of one direction of the rest");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`").required();
  cmd.add_option("values", o->values, "Parameters as name=value; a colour is r,g,b or one number");
  add_numbers(cmd, "--angles", o->angles, {0, 89.999}, "View angles in degrees from the normal");
  add_number(cmd, "--phi", o->phi, {-7, 7}, "Azimuth of the view direction in radians");
  add_number(cmd, "--points", o->points, {64, 1 << 26}, "Directions for each view");
  cmd.callback([o] {
    const Model& model = find_model(o->model);
    if (!model.has_base()) input_error("{}: has no base: expected a model that declares one", o->model);
    const measure::BoundModel bound = measure::bind_model(model, parse_values(model.info(), o->values));
    CsvWriter out("theta_o,relative_l1,share,best_scale,white_drawn,white_rest,sky_drawn,sky_rest,largest");
    for (const double angle : o->angles) {
      const forms::BaseWorth w = forms::base_worth(bound, direction(std::cos(angle * kPi / 180), o->phi), o->points);
      out.row({angle, w.relative_l1, w.share, w.best_scale, w.white_drawn, w.white_rest, w.sky_drawn, w.sky_rest,
               w.largest});
    }
    out.flush();
  });
}

}  // namespace brdfc::app
