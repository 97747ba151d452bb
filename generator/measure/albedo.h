// SPDX-License-Identifier: GPL-3.0-or-later
// Directional-hemispherical reflectance by quadrature, from the model's own eval() and sample().
//
// Nothing is clamped: a value that is NaN, infinite or negative is a ValueError that names model, parameters,
// directions and value.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::measure {

struct AlbedoOptions {
  double absolute = 1e-8;   ///< aim for the error of each component
  int max_cells = 10000;    ///< of one cubature
  int witnesses = 1 << 17;  ///< samples a lobe that judge, where two cubatures differ
};

struct Albedo {
  Rgb<double> scattered;  ///< integral of f cos(theta_i) over wi
  Rgb<double> mirror;     ///< weight of ideal reflection
  Rgb<double> transmit;   ///< weight of ideal refraction
  double error = 0;       ///< of `scattered`: estimate, largest component
  Rgb<double> total() const { return scattered + mirror + transmit; }
};
/// Albedo for a view direction with 0 < |cos_theta_o| <= 1, negative for the inside of a model of two sides. Two
/// cubatures that fail in different places are compared: one over directions (poor at ridges that are thin and curved),
/// one over the random numbers of sample() (poor at a narrow lobe seen through the samples of a wide one). Where they
/// differ they are refined, and finally judged by sampled_albedo(); what then remains between them is the error
/// reported.
Albedo albedo(const Brdf<double>&, double cos_theta_o, double phi_o = 0, const std::string& label = "",
              const AlbedoOptions& = {});

struct MeanAlbedo {
  std::vector<Rgb<double>> scattered, mirror;  ///< of each model; `mirror` holds both delta terms
  double error = 0;                            ///< standard error, largest component
};
/// Albedos of several models, averaged over the azimuth of the view direction if `phi_o` is not given, by a
/// low-discrepancy mean over the samples of `guide`, which must reach every direction where one of the models is not 0.
/// `count` samples a lobe, in four shifted copies. Quick, and equally good for peaks and ridges: for tables.
MeanAlbedo mean_albedos(const Brdf<double>& guide, const std::vector<const Brdf<double>*>& models, double cos_theta_o,
                        std::optional<double> phi_o, const std::string& label, int count, std::uint64_t seed = 0);

struct SampledAlbedo {
  Rgb<double> scattered;      ///< mean weight of sample()
  double standard_error = 0;  ///< of its mean, largest component, from independent shifts of the sequence
  double lost = 0;            ///< fraction of samples with pdf 0 (below the horizon)
  double lost_error = 0;      ///< standard error of it
};
/// Mean weight over low-discrepancy points, `count` in all.
SampledAlbedo sampled_albedo(const Brdf<double>&, double cos_theta_o, double phi_o = 0, const std::string& label = "",
                             int count = 1 << 15);

}  // namespace brdfc::measure
