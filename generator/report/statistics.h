// SPDX-License-Identifier: GPL-3.0-or-later
// How far a rendered picture is from its reference, with the part that noise alone explains.
#pragma once

#include <span>

#include "reference/image.h"

namespace brdfc {

/// Mean of renderings of the same size that differ in their random numbers alone. With two or more, the variance
/// is estimated from their spread; one alone keeps what it has. Throws std::invalid_argument when there is none,
/// or when sizes differ.
Rendering mean_of(std::span<const Rendering>);

/// Regularises relMSE where the reference is black; the same number as in Comparison.
inline constexpr double kRelMseEpsilon = 0.01;

struct Difference {
  double rel_mse = 0;     ///< as in Comparison
  double noise = 0;       ///< what rel_mse would be on average if both pictures had the same expectation
  double bias = 0;        ///< (mean a - mean b) / mean b
  double bias_error = 0;  ///< one standard deviation of `bias`, from the variance layers
};

/// Compares a picture with its reference; a missing variance layer counts as free of noise. Throws InputError when
/// sizes differ, a pixel is not finite, or the reference is black; the names are for the message.
Difference measure_difference(const Rendering& picture, const Rendering& reference, const std::string& picture_name,
                              const std::string& reference_name);

}  // namespace brdfc
