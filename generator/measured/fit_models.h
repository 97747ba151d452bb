// SPDX-License-Identifier: GPL-3.0-or-later
// Fits of models to a measured BRDF.
//
// The error is the light that a picture would misplace: the integral of |f - data| cos cos over both hemispheres,
// divided by that of data cos cos.
// Colours, and matte light of which a model has none itself, are found by linear least squares with weights that
// approach this error; numbers are found by search, and choices by trying all.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "measured/measured_model.h"

namespace brdfc::measured {

struct ModelFit {
  const Model* model = nullptr;
  ParamValues values;
  /// Albedo of a Lambert surface that is added to the model; nullopt if the model does without.
  std::optional<Rgb<double>> matte;
  double error = 0;  ///< share of the light that is misplaced
  /// Share of a white world's light that the model's ideal mirror reflects, which data over a grid of angles do not
  /// hold and the error does not count.
  double mirror = 0;
  int found = 0;  ///< number of parameters that were fitted
  double seconds = 0;
  /// Numbers whose search ended at the end of what the model accepts, or of what data resolve.
  std::vector<std::string> stopped = {};
  /// The fit of an anisotropic model without an angle of its own to data that are turned about the normal, counted from
  /// x to y, if it comes much closer.
  struct Turned {
    double angle = 0;  ///< radians
    double error = 0;
    ParamValues values = {};
    std::optional<Rgb<double>> matte = {};
  };
  std::optional<Turned> turned = {};
};

/// Whether a fitted model has a mirror whose light is worth a word: less than 0.005 % is not.
inline bool has_mirror(const ModelFit& f) { return f.mirror >= 5e-5; }

/// The values to four digits, for people: a measurement has no more.
ParamValues rounded(ParamValues);

/// What is to be said of the search beside the parameters that were found; begins with "; " unless it is empty.
std::string remarks(const ModelFit&);

/// Why fits stand before ones with smaller errors, in a sentence; nullopt if none does.
std::optional<std::string> order_of_fits(const std::vector<ModelFit>&);

/// Whether light of a Lambert surface may be added to the models.
enum class Matte { None, Added };
/// The models whose f is not 0, fitted, those with the least sum of error and mirror first; of models whose sums hardly
/// differ, those with fewer parameters. Light that passes through is not considered. `progress`, if there is one, is
/// called after each model, from any thread, with the number of models that are done.
std::vector<ModelFit> fit_models(const Measurement&, const MeasuredModel&, const std::vector<const Model*>&, Matte,
                                 const std::function<void(const Model&, std::size_t done)>& progress = {});

}  // namespace brdfc::measured
