// SPDX-License-Identifier: GPL-3.0-or-later
// Directional albedo (directional-hemispherical reflectance), by quadrature of the model's own eval() and sample().
//
// No value is clamped. A value that is NaN, infinite or negative is a ValueError that names model, parameters,
// directions and value.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::measure {

struct AlbedoOptions {
  double absolute = 1e-8;   ///< target for the error of each component
  int max_cells = 10000;    ///< most cells of one cubature
  int witnesses = 1 << 17;  ///< samples for each lobe, to decide where two cubatures differ
};

struct Albedo {
  Rgb<double> scattered;  ///< integral of f cos(theta_i) over wi
  Rgb<double> mirror;     ///< weight of ideal reflection
  Rgb<double> transmit;   ///< weight of ideal refraction
  double error = 0;       ///< estimated error of `scattered`, largest component
  Rgb<double> total() const { return scattered + mirror + transmit; }
};
/// Albedo for a view direction with 0 < |cos_theta_o| <= 1. A negative cosine is the inside of a two-sided model. The
/// result of two cubatures that fail in different places is compared: one over directions, which is poor at thin,
/// curved ridges, and one over the random numbers of sample(), which is poor at a narrow lobe that is seen through the
/// samples of a wide one. If they differ, both are refined, and finally sampled_albedo() decides between them. The
/// difference that remains is reported as the error.
Albedo albedo(const Brdf<double>&, double cos_theta_o, double phi_o = 0, const std::string& label = "",
              const AlbedoOptions& = {});

struct MeanAlbedo {
  std::vector<Rgb<double>> scattered, mirror;  ///< one element for each model; `mirror` is the sum of both delta terms
  double error = 0;                            ///< standard error, largest component
};
/// Albedos of several models, as a low-discrepancy mean over samples of `guide`. `guide` must sample every direction in
/// which one of the models is not 0. Without `phi_o` they are averaged over the azimuth of the view. `count` is the
/// number of samples for each lobe, in four shifted copies. This is fast and handles peaks and ridges equally well, so
/// it is used for tables.
MeanAlbedo mean_albedos(const Brdf<double>& guide, const std::vector<const Brdf<double>*>& models, double cos_theta_o,
                        std::optional<double> phi_o, const std::string& label, int count, std::uint64_t seed = 0);

struct SampledAlbedo {
  Rgb<double> scattered;      ///< mean weight of sample()
  double standard_error = 0;  ///< of `scattered`, largest component, from independent shifts of the sequence
  double lost = 0;            ///< fraction of samples with pdf 0 (below the horizon)
  double lost_error = 0;      ///< standard error of `lost`
};
/// Albedo as the mean weight of `count` low-discrepancy samples.
SampledAlbedo sampled_albedo(const Brdf<double>&, double cos_theta_o, double phi_o = 0, const std::string& label = "",
                             int count = 1 << 15);

}  // namespace brdfc::measure
