// SPDX-License-Identifier: GPL-3.0-or-later
// brdfc sample: directions sampled from a model.
#include <iostream>
#include <limits>
#include <random>

#include "app/commands.h"
#include "app/numbers.h"
#include "core/csv.h"
#include "measure/bound_model.h"
#include "reference/patterns.h"

namespace brdfc::app {
namespace {

void write_sample(const measure::BoundModel& bound, const std::string& where, const Vec3<double>& wo,
                  const Vec3<double>& u, CsvWriter& out) {
  // Below the surface of a model of one side every sample is lost, and formulas may have no direction there.
  const bool lost = !(wo.z > 0) && !bound.model->two_sided();
  const Sample<double> s = lost ? Sample<double>{{0, 0, 1}, {0, 0, 0}, 0} : bound.brdf->sample(wo, u);
  const std::string label = where + ": " + bound.label;
  measure::require_value(s.pdf, "pdf", label, s.wi, wo);
  measure::require_value(s.weight, "weight", label, s.wi, wo);
  out.row({s.wi.x, s.wi.y, s.wi.z, s.weight.r, s.weight.g, s.weight.b, s.pdf});
}

}  // namespace

void add_sample_command(Command app) {
  struct Options {
    std::string model;
    std::vector<std::string> values;
    std::vector<double> wo;
    int count = 0;
    std::uint64_t seed = 0;
    std::string pattern = "random";
  };
  auto o = std::make_shared<Options>();
  const Command cmd = app.add_subcommand(
      "sample",
      "Directions sampled from the model, with their weights f cos / pdf and pdfs per solid angle.\n"
      "A sample with pdf 0 is lost (below the horizon); its weight is 0, and its direction (0, 0, 1) if wo is below.\n"
      "stdin:  CSV with header wo_x,wo_y,wo_z,u1,u2,u3 (0 <= u < 1), unless --count is given\n"
      "stdout: CSV with header wi_x,wi_y,wi_z,weight_r,weight_g,weight_b,pdf");
  cmd.add_option("model", o->model, "Model, as in `brdfc list`").required();
  cmd.add_option("values", o->values, "Parameters as name=value; a colour is r,g,b or one number");
  const Option count =
      add_number(cmd, "--count", o->count, {.low = 1}, "Number of samples to draw with built-in random numbers");
  add_number(cmd, "--seed", o->seed, {}, "Seed of the random numbers").needs(count);
  cmd.add_option("--pattern", o->pattern,
                 "Sampling pattern, as for the pixels of the reference renderer: random, regular, jittered,\n"
                 "multi_jittered or hammersley")
      .is_member(reference::pattern_names())
      .needs(count);
  add_numbers(cmd, "--wo", o->wo, {}, "View direction x,y,z").expected(3).needs(count);
  cmd.callback([o] {
    const Model& model = find_model(o->model);
    const measure::BoundModel bound = measure::bind_model(model, parse_values(model.info(), o->values));
    if (!model.has_scatter())
      input_error("{}: expected a model that scatters; this one has ideal reflection alone", o->model);
    CsvWriter out("wi_x,wi_y,wi_z,weight_r,weight_g,weight_b,pdf");
    if (o->count > 0) {
      if (o->wo.size() != 3) input_error("--wo: expected a view direction x,y,z with --count");
      Vec3<double> wo{o->wo[0], o->wo[1], o->wo[2]};
      const double len = length(wo);
      if (!(std::abs(len - 1) <= 1e-6)) input_error("--wo: expected a unit vector, its length is {}", len);
      wo = wo / len;
      std::mt19937_64 random(o->seed);
      const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
      const reference::PatternPoints points(reference::pattern_named(o->pattern), o->count);
      for (int i = 0; i < o->count; ++i) {
        Vec3<double> u;
        if (points.pattern() == reference::Pattern::Random) {
          const double u1 = uniform(), u2 = uniform(), u3 = uniform();
          u = {u1, u2, u3};
        } else {
          reference::PathSampler sampler(points, o->seed, 0, i);
          const double lobe = sampler.one(0);
          const auto [x, y] = sampler.two(1);
          u = {lobe, x, y};
        }
        write_sample(bound, fmt::format("sample {}", i + 1), wo, u, out);
      }
    } else {
      CsvReader in(std::cin, "stdin", {"wo_x", "wo_y", "wo_z", "u1", "u2", "u3"});
      if (in.empty()) input_error("stdin: expected a CSV table with the header wo_x,wo_y,wo_z,u1,u2,u3");
      std::vector<double> row;
      while (in.next(row)) {
        const Vec3<double> wo = in.unit_vector(row, 0);
        for (int i = 3; i < 6; ++i)
          if (!(row[std::size_t(i)] >= 0 && row[std::size_t(i)] < 1))
            input_error("{}: u{}: expected a number in [0, 1), got {}", in.where(), i - 2, row[std::size_t(i)]);
        write_sample(bound, in.where(), wo, {row[3], row[4], row[5]}, out);
      }
    }
    out.flush();
  });
}

}  // namespace brdfc::app
