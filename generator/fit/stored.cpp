// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/stored.h"

#include <fmt/format.h>

#include "core/data_dir.h"
#include "core/hash.h"
#include "core/sequence.h"
#include "fit/axis.h"
#include "fit/roles.h"
#include "fit/settings.h"
#include "model/sampling.h"

namespace brdfc::fit {
namespace {

/// All that a fit depends on but the code; a change of the code that changes fits changes the first number.
std::string settings() {
  return fmt::format("4 {} {} {} {} {} {} {} {}", kSettings.views, kSettings.trial_stride, kSettings.points,
                     kSettings.ridge, kSettings.first_steps, kSettings.steps, kSettings.worse_between,
                     kSettings.slightly_off);
}
/// What a model computes along an axis, to five digits. The text of its formula would not do: the order of statements
/// in it is that in which a compiler evaluates arguments.
std::string samples_of(const Model& model, const ParamValues& values, const FitAxis& axis) {
  constexpr int kPairs = 64;
  std::string text;
  for (const double x : {0.0, 0.2, 0.5, 0.8, 1.0}) {
    ParamValues here = values;
    here[axis.parameter] = axis.at(x);
    const auto brdf = model.make_double(here);
    Sequence3 points(1);
    for (int i = 0; i < kPairs; ++i) {
      const Vec3<double> a = points.next(), b = points.next();
      const Vec3<double> wo = direction(0.02 + 0.98 * a.x, 2 * kPi * a.y);
      const Vec3<double> drawn = brdf->sample(wo, b).wi;
      const Rgb<double> f = brdf->eval(i % 2 == 0 && drawn.z > 0 ? drawn : direction(b.x, 2 * kPi * b.y), wo);
      text += fmt::format("{:.5g} {:.5g} {:.5g}\n", f.r, f.g, f.b);
    }
  }
  return text;
}

}  // namespace

std::string hash_of(const Model& model, const ParamValues& values) {
  const FitAxis axis = fit_axis(*roles_of(model, values).axis());
  return sha256(fmt::format("{}\n{}\n{} {} {} {}\n{}\n{}", model.info().name, format_values(model.info(), values),
                            axis.parameter, axis.low, axis.high, name_of(axis.scale), settings(),
                            samples_of(model, values, axis)));
}

std::filesystem::path path_of(const Model& model, const std::string& hash) {
  return data_dir() / "data" / "fits" / fmt::format("{}_{}.exr", model.info().name, hash.substr(0, 16));
}

std::filesystem::path stored_fit(const Model& model, const ParamValues& values) {
  return path_of(model, hash_of(model, along_axis(model, values).values));
}

}  // namespace brdfc::fit
