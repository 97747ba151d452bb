// SPDX-License-Identifier: GPL-3.0-or-later
// Difference between a rendered picture and its reference, and the part of it that noise explains.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "reference/image.h"

namespace brdfc::report {

/// Mean of renderings of the same size that differ only in their random numbers. The variance of two or more is
/// estimated from their spread; a single rendering keeps its variance layer. Throws std::invalid_argument if there is
/// none or if sizes differ.
reference::Rendering mean_of(std::span<const reference::Rendering>);

/// The median of numbers, of which there must be one at least; of an even count the mean of the middle two.
double median(std::vector<double>);

/// Regularises relMSE where the reference is black. The same number is used in Comparison.
inline constexpr double kRelMseEpsilon = 0.01;

struct Difference {
  double rel_mse = 0;     ///< as in Comparison
  double noise = 0;       ///< expected rel_mse if both pictures had the same expectation
  double bias = 0;        ///< (mean a - mean b) / mean b
  double bias_error = 0;  ///< one standard deviation of `bias`, from the variance layers

  /// True if the bias exceeds three standard deviations, which noise alone does once in 370 cases, and rounding.
  bool biased() const;
};

/// Compares a picture with its reference. A picture without a variance layer counts as free of noise. Throws InputError
/// if sizes differ, a pixel is not finite or the reference is black. The names are for the message.
Difference measure_difference(const reference::Rendering& picture, const reference::Rendering& reference,
                              const std::string& picture_name, const std::string& reference_name);

/// Welch's t-test of the hypothesis that both pictures have the same expectation. It tests the luminance of every
/// pixel, and the mean of every tile of kTestTile x kTestTile pixels. A family of n tests rejects where p < 1 - (1 -
/// kTestSignificance)^(1/n) (Sidak). A pixel is tested twice: with the noise estimated from its own spread, and with
/// the mean noise of its tile. The larger p counts. Where light arrives once in a thousand samples, the spread of most
/// pixels does not show that they are noisy. A tile is tested twice, too: with the spread of its mean, which by chance
/// is small in one tile of many if pictures are few, and with the noise of its pixels.
struct WelchTest {
  int pixels = 0, tiles = 0;
  int rejected_pixels = 0, rejected_tiles = 0;
  double worst_pixel = 1, worst_tile = 1;  ///< smallest p of the pixels and of the tiles
  std::array<int, 20> histogram{};         ///< of p from a pixel's own spread, for pixels with noise
  double uniform = 1;                      ///< p of a chi-square test for a flat histogram
  reference::Image p;                      ///< p of every pixel, in all three channels

  double accepted() const { return pixels > 0 ? 1 - double(rejected_pixels) / pixels : 1; }
  /// True if at least kTestAccepted of the pixels and all tiles are accepted.
  bool passed() const;
};
nlohmann::ordered_json to_json(const WelchTest&);
inline constexpr int kTestTile = 16;
inline constexpr double kTestSignificance = 0.01, kTestAccepted = 0.9975;

/// At least two `pictures` are needed, which differ only in their random numbers. The reference needs a variance layer.
/// Its channels are assumed to be fully correlated, which gives the largest possible variance of luminance. Rounding to
/// single precision counts as noise, and so does 1e-12 of the picture's mean radiance. Throws std::invalid_argument for
/// less than two pictures or a missing variance, and InputError if sizes differ or a pixel is not finite.
WelchTest welch_test(std::span<const reference::Rendering> pictures, const reference::Rendering& reference,
                     const std::string& picture_name, const std::string& reference_name);

}  // namespace brdfc::report
