// SPDX-License-Identifier: GPL-3.0-or-later
// How far a rendered picture is from its reference, with the part that noise alone explains.
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "reference/image.h"

namespace brdfc::report {

/// Mean of renderings of the same size that differ in their random numbers alone. With two or more, the variance
/// is estimated from their spread; one alone keeps what it has. Throws std::invalid_argument when there is none,
/// or when sizes differ.
reference::Rendering mean_of(std::span<const reference::Rendering>);

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
Difference measure_difference(const reference::Rendering& picture, const reference::Rendering& reference,
                              const std::string& picture_name, const std::string& reference_name);

/// Welch's t-test of "both have the same expectation" on luminance, for every pixel and for the mean of every tile of
/// kTestTile x kTestTile pixels. A family of n tests rejects where p < 1 - (1 - kTestSignificance)^(1/n) (Sidak).
/// A pixel's noise is taken from its own spread and, a second time, from the mean of its tile's; the larger p counts:
/// where light comes once in a thousand samples, few pixels know by themselves that they are noisy.
struct WelchTest {
  int pixels = 0, tiles = 0;
  int rejected_pixels = 0, rejected_tiles = 0;
  double worst_pixel = 1, worst_tile = 1;  ///< smallest p
  std::array<int, 20> histogram{};         ///< of the p, by their own spread, of the pixels that have noise
  double uniform = 1;                      ///< p of a chi-square test that the histogram is flat
  reference::Image p;                      ///< p of every pixel, in all three channels

  double accepted() const { return pixels > 0 ? 1 - double(rejected_pixels) / pixels : 1; }
  /// At least kTestAccepted of the pixels and all tiles accepted.
  bool passed() const;
};
nlohmann::ordered_json to_json(const WelchTest&);
inline constexpr int kTestTile = 16;
inline constexpr double kTestSignificance = 0.01, kTestAccepted = 0.9975;

/// `pictures` differ in their random numbers alone, two at least; the reference needs a variance layer (its channels
/// are taken to vary together, which for luminance is the largest variance they allow). What single precision rounds
/// counts as noise, and so does 1e-12 of the picture's mean radiance. Throws std::invalid_argument for too few pictures
/// or no variance, InputError when sizes differ or a pixel is not finite.
WelchTest welch_test(std::span<const reference::Rendering> pictures, const reference::Rendering& reference,
                     const std::string& picture_name, const std::string& reference_name);

}  // namespace brdfc::report
