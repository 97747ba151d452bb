// SPDX-License-Identifier: GPL-3.0-or-later
// Measurements for the properties that models declare, and the table that compares models by them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "measure/bound_model.h"
#include "measure/probes.h"

namespace brdfc::measure {

/// Searches for a pair of directions above the surface where f is 0. Underflow is excluded: on the way from a place
/// where f is positive, the last positive value is far above the smallest number. Returns the place, or nullopt if none
/// was found.
std::optional<std::string> find_dark_place(const Model&, const ParamValues&, int pairs, Random&);

/// The largest jump of a first derivative of f, along arcs through the four-dimensional space of pairs of directions.
/// The unit is the largest derivative on the arc, or the largest value if that is larger.
struct Edge {
  double jump = 0;    ///< 0 for a smooth model
  std::string where;  ///< directions and values there, for messages
};
/// Searches this number of random arcs.
Edge sharpest_edge(const BoundModel&, int arcs, Random&);

/// Statistics of the weights of sample() for one view direction.
struct Weights {
  double spread = 0;    ///< (largest - smallest) / largest of valid samples, worst channel
  double variance = 0;  ///< variance over the squared mean, with lost samples as 0; worst channel
  int kept = 0;         ///< number of valid samples
};
Weights sampled_weights(const BoundModel&, const Vec3<double>& wo, int samples, Random&);

/// (largest - smallest) / largest of f over pairs of directions, worst channel; nullopt if a channel is 0 everywhere.
std::optional<double> unevenness(const Brdf<double>&, int pairs, Random&);

/// Share of the reflected light within 0.05 rad of the ideal mirror direction, minimum over several views; nullopt if
/// no light is reflected.
std::optional<double> least_mirror_share(const Brdf<double>&, int samples, Random&);

/// (largest - smallest) / (largest + smallest) of f on a cone around the mirror direction, for a view at 80 degrees.
/// The cone is the one where f has fallen to half its peak, or 8 degrees if that is wider. The result is 0 for a lobe
/// that is round about the mirror direction, such as Phong's, and nullopt for a model without light there.
std::optional<double> grazing_anisotropy(const BoundModel&);

/// Measured columns of the table, with default parameters and colours at 1.
struct ModelFacts {
  bool scatters = true;              ///< false for a model with a mirror term only
  double reflected = 0;              ///< albedo for a view at 80 degrees
  double variance = 0;               ///< variance of f cos / pdf over its squared mean, for a view at 45 degrees
  std::optional<double> anisotropy;  ///< grazing_anisotropy()
};
ModelFacts measure_facts(const Model&);

/// The table for the documentation, with a row for each registered model, as Markdown or as text in columns.
std::string property_table(bool markdown);

}  // namespace brdfc::measure
