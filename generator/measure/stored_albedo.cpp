// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/stored_albedo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <random>

#include "core/data_dir.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/sequence.h"
#include "measure/albedo_file.h"
#include "measure/albedo_polynomial.h"
#include "measure/albedo_settings.h"
#include "measure/tabulate_albedo.h"
#include "model/choices.h"
#include "model/sampling.h"

namespace brdfc::measure {
namespace {

/// All that a table depends on but the code; a change of the code that changes tables changes the first number.
std::string settings() {
  return fmt::format("1 {} {} {} {} {} {} {} {}", kTableSettings.min_cos, kTableSettings.aim_error,
                     kTableSettings.max_points, kTableSettings.max_points_4, kTableSettings.same,
                     kTableSettings.grid_samples, kTableSettings.proof_samples, kTableSettings.profile_noise);
}

/// What a model computes, to five digits, at random values of all its parameters. The text of its formula would not do:
/// the order of statements in it is that in which a compiler evaluates arguments. Not near the upper ends of ranges,
/// where exponents of a million leave what a library rounds in the fifth digit.
std::string samples_of(const Model& model) {
  constexpr int kPlaces = 64, kPairs = 4;
  constexpr double kUpTo = 0.7;
  std::mt19937_64 random(31);
  std::uniform_real_distribution<double> uniform;
  Sequence3 points(1);
  std::string text;
  const auto add = [&](const Rgb<double>& c) { text += fmt::format("{:.5g} {:.5g} {:.5g}\n", c.r, c.g, c.b); };
  for (const Choices& choices : choice_combinations(model.info()))
    for (int place = 0; place < kPlaces; ++place) {
      ParamValues values = with_choices(model.info(), choices);
      for (const ParamInfo& p : model.info().params) {
        if (p.kind == ParamKind::Number) values[p.name] = coordinate_of(p).at(kUpTo * uniform(random));
        if (p.kind != ParamKind::Color) continue;
        std::array<double, 3> color;
        for (double& c : color) c = uniform(random);
        values[p.name] = color;
      }
      const auto brdf = model.make_double(values);
      for (int i = 0; i < kPairs; ++i) {
        const Vec3<double> a = points.next(), b = points.next();
        const Vec3<double> wo = direction(0.02 + 0.98 * a.x, 2 * kPi * a.y), drawn = brdf->sample(wo, b).wi;
        add(brdf->eval(i % 2 == 0 && drawn.z > 0 ? drawn : direction(b.x, 2 * kPi * b.y), wo));
        add(brdf->mirror(wo));
        add(brdf->transmit(wo));
      }
    }
  return text;
}

std::string hash_of(const Model& model) {
  std::string params;
  for (const ParamInfo& p : model.info().params)
    params += fmt::format("{} {} {} {} {}\n", p.name, int(p.kind), p.min, p.max, fmt::join(p.choices, " "));
  return sha256(fmt::format("{}\n{}\n{}\n{}{}", model.info().name,
                            format_values(model.info(), complete(model.info(), {})), settings(), params,
                            samples_of(model)));
}

}  // namespace

bool has_albedo_table(const Model& model) {
  const std::vector<ParamInfo>& params = model.info().params;
  return model.has_scatter() ||
         std::count_if(params.begin(), params.end(), [](const auto& p) { return p.kind == ParamKind::Number; }) < 3;
}

std::filesystem::path stored_albedo(const Model& model) {
  return data_dir() / "data" / "albedos" / fmt::format("{}_{}.exr", model.info().name, hash_of(model).substr(0, 16));
}

AlbedoTable albedo_table_of(const Model& model) {
  const std::filesystem::path path = stored_albedo(model);
  if (!std::filesystem::exists(path)) {
    note_missing("stored albedo of " + model.info().name, path.parent_path(), "up to a minute");
    return tabulate_albedo(model);
  }
  AlbedoTable table = read_albedo_exr(path);
  if (table.model != model.info().name)
    input_error("{}: model: expected {}, got {}", path.string(), model.info().name, table.model);
  return table;
}

}  // namespace brdfc::measure
