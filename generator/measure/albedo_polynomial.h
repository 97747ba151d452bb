// SPDX-License-Identifier: GPL-3.0-or-later
// A model's directional albedo as a polynomial in its colours: the coefficients at any view and any numbers, and what
// they depend on.
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

  /// A value at t in [0, 1], uniform on the scale; the cosine crowds towards grazing, where albedos bend most.
  double at(double t) const;
};
/// That of a Number parameter, over its whole range.
Coordinate coordinate_of(const ParamInfo&);

/// A value for each coordinate.
using Position = std::vector<double>;

/// Averaged over the azimuth of the view direction.
inline constexpr std::nullopt_t kAllAzimuths = std::nullopt;

/// Coefficients at a position, by monomial; a monomial's index has the powers of the colours as digits, the first
/// colour's the lowest, each running to the colour's degree.
struct Coefficients {
  std::vector<Rgb<double>> scattered, mirror;
  double error = 0;  ///< one standard error of each coefficient
};
/// Which of them: of scattered light or of ideal reflection.
struct Monomial {
  bool mirror;
  std::size_t index;

  const Rgb<double>& in(const Coefficients& c) const { return mirror ? c.mirror[index] : c.scattered[index]; }
  /// Standard error: a mirror's weight is no mean of samples.
  double error_in(const Coefficients& c) const { return mirror ? 0 : c.error; }
};

/// Largest magnitude of the channels.
double max_abs(const Rgb<double>&);
/// What errors of an albedo are in units of: 1, or the value itself where a model without bounds gives off more than it
/// gets.
double unit_of(const Rgb<double>& albedo);

class AlbedoPolynomial {
 public:
  /// Finds out how the albedo depends on colours and azimuth, at random positions for each of these combinations of
  /// choices. Throws ValueError for a model of more than five colours, and where it gives a value that is NaN, infinite
  /// or negative.
  AlbedoPolynomial(const Model&, const std::vector<ParamValues>& combinations);

  const std::vector<Coordinate>& coordinates() const { return coordinates_; }  ///< the view cosine first
  const std::vector<std::string>& colors() const { return colors_; }
  bool depends_on_azimuth() const { return depends_on_azimuth_; }
  /// Does a coordinate nothing but turn the model about the normal? Then means over the azimuth don't depend on it.
  bool only_turns(std::size_t coordinate) const { return !turns_.empty() && turns_[coordinate]; }
  /// Sets coordinates that only turn the model to their defaults.
  void freeze_turns(Position&) const;

  /// `combination` with the numbers of a position; its colours stay away.
  ParamValues values_at(const ParamValues& combination, const Position&) const;
  /// The model's name and complete values, for messages.
  std::string label(const ParamValues&) const;
  /// Uniform on every coordinate's scale.
  Position random_position(std::mt19937_64&) const;

  /// By values at colours of 0, 1/2 and 1. `phi` is the azimuth of the view in radians, `samples` are those a lobe.
  Coefficients coefficients(const ParamValues& combination, const Position& x, std::optional<double> phi,
                            std::size_t samples = kTableSettings.grid_samples, std::uint64_t seed = 0) const {
    return coefficients(combination, x, phi, samples, seed, share_channels_);
  }
  /// How many monomials there are, of scattered light as of ideal reflection.
  std::size_t monomials() const { return stride(colors_.size()); }
  /// The colours of a monomial, each as often as its power says; and back.
  std::vector<std::string> color_names(std::size_t monomial) const;
  std::size_t monomial_of(const std::vector<std::string>& names) const;
  /// The albedo, mirror included, at colours, three numbers for each.
  Rgb<double> combine(const Coefficients&, const std::vector<double>& colors) const;

 private:
  /// With share_channels three nodes of the polynomial are red, green and blue of one model: a third of the work.
  Coefficients coefficients(const ParamValues& combination, const Position& x, std::optional<double> phi,
                            std::size_t samples, std::uint64_t seed, bool share_channels) const;
  /// How many powers the colours before c take up in an index of monomials.
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
  bool share_channels_ = false;  ///< channels are alike and apart
  bool depends_on_azimuth_ = false;
  std::vector<char> turns_;  ///< per coordinate; empty if nothing turns the model
};

}  // namespace brdfc::measure
