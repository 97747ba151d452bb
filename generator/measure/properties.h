// SPDX-License-Identifier: GPL-3.0-or-later
// Measures behind the properties that models declare, and the table that compares the models by them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "measure/bound_model.h"
#include "measure/probes.h"

namespace brdfc::measure {

/// A pair of directions above the surface for which f is 0, proven not to be an underflow: on the way from a place with
/// f > 0 the last positive value is far above the smallest number there is. Nothing if none was found.
std::optional<std::string> find_dark_place(const Model&, const ParamValues&, int pairs, Random&);

/// The largest jump of a first derivative of f that arcs through the four-dimensional space of pairs of directions
/// cross, in units of the largest derivative (or value, if that is larger) on the arc.
struct Edge {
  double jump = 0;    ///< 0 for a smooth model
  std::string where;  ///< directions and values there, for messages
};
/// Looks along so many random arcs.
Edge sharpest_edge(const BoundModel&, int arcs, Random&);

/// Weights of sample() for one view direction.
struct Weights {
  double spread = 0;    ///< (largest - smallest) / largest over samples that exist, worst channel
  double variance = 0;  ///< over the square of the mean, lost samples counted as 0; worst channel
  int kept = 0;         ///< samples that exist, of those drawn
};
Weights sampled_weights(const BoundModel&, const Vec3<double>& wo, int samples, Random&);

/// (largest - smallest) / largest of f over pairs of directions, worst channel; nothing where a channel is 0
/// throughout.
std::optional<double> unevenness(const Brdf<double>&, int pairs, Random&);

/// Share of the reflected light that leaves within 0.05 rad of the direction of ideal reflection, the least over
/// several view directions; nothing if there is no light.
std::optional<double> least_mirror_share(const Brdf<double>&, int samples, Random&);

/// (largest - smallest) / (largest + smallest) of f on a cone around the direction of ideal reflection for a view at
/// 80 degrees: of the cone where f has fallen to half its peak, or of 8 degrees if that is wider. 0 for a lobe that is
/// round about that direction, as Phong's; nothing for a model without light there.
std::optional<double> grazing_anisotropy(const BoundModel&);

/// What the table reports beside the declarations, with default parameters and colours at 1.
struct ModelFacts {
  bool scatters = true;              ///< false for a model that is a mirror term alone
  double reflected = 0;              ///< share of the light reflected, seen at 80 degrees
  double variance = 0;               ///< of f cos / pdf over its mean squared, seen at 45 degrees
  std::optional<double> anisotropy;  ///< grazing_anisotropy()
};
ModelFacts measure_facts(const Model&);

/// The table of docs: a row for each registered model, as Markdown or as text in columns.
std::string property_table(bool markdown);

}  // namespace brdfc::measure
