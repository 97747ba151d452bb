// SPDX-License-Identifier: GPL-3.0-or-later
// A model's directional albedo as a polynomial in its colour parameters: the coefficients at any view and for any
// numbers, and what they depend on.
#pragma once

#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "measure/albedo_settings.h"
#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::measure {

/// A coordinate of the albedo: the view cosine or a Number parameter, in units of the parameter.
struct Coordinate {
  std::string name;
  ScaledRange range;

  /// The value at t in [0, 1], uniform on the scale. Values of the cosine are denser towards grazing angles, where
  /// albedos change fastest.
  double at(double t) const;
};
/// The coordinate of a Number parameter, over its whole range.
Coordinate coordinate_of(const ParamInfo&);

/// A value for each coordinate.
using Position = std::vector<double>;

/// Stands for an average over the azimuth of the view direction.
inline constexpr std::nullopt_t kAllAzimuths = std::nullopt;

/// The coefficients at a position, by monomial. The index of a monomial has the powers of the colours as its digits,
/// with the first colour's power as the lowest digit. Each digit runs from 0 to the degree of its colour.
struct Coefficients {
  std::vector<Rgb<double>> scattered, mirror;
  double error = 0;  ///< one standard error of each coefficient
};
/// A coefficient: its monomial, of scattered light or of ideal reflection.
struct Monomial {
  bool mirror;
  std::size_t index;

  const Rgb<double>& in(const Coefficients& c) const { return mirror ? c.mirror[index] : c.scattered[index]; }
  /// Standard error. It is 0 for a mirror, whose weight is not a mean of samples.
  double error_in(const Coefficients& c) const { return mirror ? 0 : c.error; }
};

/// Largest magnitude of the channels.
double max_abs(const Rgb<double>&);
/// The unit for errors of an albedo: 1, or the albedo itself for a model that reflects more than it receives.
double unit_of(const Rgb<double>& albedo);

class AlbedoPolynomial {
 public:
  /// Determines how the albedo depends on colours and azimuth, at random positions for each of these combinations of
  /// choices. Throws ValueError for a model with more than five colours, and for a value that is NaN, infinite or
  /// negative.
  AlbedoPolynomial(const Model&, const std::vector<ParamValues>& combinations);

  const std::vector<Coordinate>& coordinates() const { return coordinates_; }  ///< the view cosine first
  const std::vector<std::string>& colors() const { return colors_; }
  bool depends_on_azimuth() const { return depends_on_azimuth_; }
  /// True if a coordinate does nothing but rotate the model about the normal. Azimuthal averages do not depend on it
  /// then.
  bool only_turns(std::size_t coordinate) const { return !turns_.empty() && turns_[coordinate]; }
  /// Sets the coordinates that only rotate the model to their defaults.
  void freeze_turns(Position&) const;

  /// `combination` with the numbers of a position added. Colours are not set.
  ParamValues values_at(const ParamValues& combination, const Position&) const;
  /// The model's name and complete values, for messages.
  std::string label(const ParamValues&) const;
  /// A random position, uniform on every coordinate's scale.
  Position random_position(std::mt19937_64&) const;

  /// Computes the coefficients from albedos at colours of 0, 1/2 and 1. `phi` is the azimuth of the view in radians,
  /// `samples` the number of samples for each lobe.
  Coefficients coefficients(const ParamValues& combination, const Position& x, std::optional<double> phi,
                            std::size_t samples = kTableSettings.grid_samples, std::uint64_t seed = 0) const {
    return coefficients(combination, x, phi, samples, seed, share_channels_);
  }
  /// Number of monomials. It is the same for scattered light and for ideal reflection.
  std::size_t monomials() const { return stride(colors_.size()); }
  /// The colours of a monomial, each repeated as often as its power, and the inverse.
  std::vector<std::string> color_names(std::size_t monomial) const;
  std::size_t monomial_of(const std::vector<std::string>& names) const;
  /// The albedo, including the mirror, at colours that are given as three numbers each.
  Rgb<double> combine(const Coefficients&, const std::vector<double>& colors) const;

 private:
  /// With share_channels, the red, green and blue of one model are three nodes of the polynomial, which takes a third
  /// of the work.
  Coefficients coefficients(const ParamValues& combination, const Position& x, std::optional<double> phi,
                            std::size_t samples, std::uint64_t seed, bool share_channels) const;
  /// Distance in the index of monomials between neighbouring powers of colour c.
  std::size_t stride(std::size_t c) const;
  int power(std::size_t monomial, std::size_t c) const {
    return int(monomial / stride(c) % std::size_t(degrees_[c] + 1));
  }
  void study_degrees(const std::vector<ParamValues>& combinations);
  void study_channels(const std::vector<ParamValues>& combinations);
  void study_azimuth(const std::vector<ParamValues>& combinations);

  const Model& model_;
  std::vector<Coordinate> coordinates_;
  std::vector<std::string> colors_;
  std::vector<int> degrees_;     ///< of the polynomial in each colour
  bool share_channels_ = false;  ///< channels follow the same formula and are independent
  bool depends_on_azimuth_ = false;
  std::vector<char> turns_;  ///< per coordinate; empty if nothing turns the model
};

}  // namespace brdfc::measure
