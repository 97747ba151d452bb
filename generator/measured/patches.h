// SPDX-License-Identifier: GPL-3.0-or-later
// A BRDF as a matrix of averages: the hemispheres of incident and outgoing directions are divided into patches, as by
// J. H. Klems (A New Method for Predicting the Solar Heat Gain of Complex Fenestration Systems, ASHRAE Transactions
// 100-1, 1994).
//
// A patch of one hemisphere and one of the other have a number, the mean of the BRDF over both, in projected solid
// angle: the sum of a column's numbers times their patches' projected solid angles is the directional-hemispherical
// reflectance.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "measured/measurement.h"

namespace brdfc::measured {

/// A division of the hemisphere: rings about the normal, each cut into equal azimuths, of which the first is centred on
/// azimuth 0. Patches are numbered by ring from the normal on, then by azimuth. Angles are in degrees.
class Patches {
 public:
  struct Ring {
    double from, to;     ///< angles to the normal
    std::size_t number;  ///< of azimuths
  };
  /// Patches around a direction and their weights, which sum to 1.
  struct Around {
    std::array<std::size_t, 4> patch;
    std::array<double, 4> weight;
  };

  Patches(std::string name, std::vector<Ring> rings);
  /// The bases that WINDOW and Radiance know without a table. In July 2022 Radiance changed two of them
  /// (src/common/bsdf_m.c 3.45), so these are there twice, the later one first.
  static const std::vector<Patches>& known();

  const std::string& name() const { return name_; }
  const std::vector<Ring>& rings() const { return rings_; }
  std::size_t size() const { return size_; }
  std::size_t patch(double theta, double phi) const;
  /// For values that are linear between the centres of patches, in theta and in phi.
  Around around(double theta, double phi) const;
  /// The widest patch, along theta or phi.
  double widest() const;

 private:
  std::size_t ring(double theta) const;

  std::string name_;
  std::vector<Ring> rings_;
  std::vector<std::size_t> first_;  ///< patch of each ring
  std::vector<double> centres_;
  std::size_t size_ = 0;
};

/// The means over pairs of patches, and values in between that have these means.
///
/// Linear interpolation between the centres would make highlights weaker and their surroundings brighter. Therefore the
/// values at the centres are changed until their interpolation has nearly the means of the file, and each pair of
/// patches is scaled to have them exactly.
///
/// What a mirror reflects is in one patch alone. Interpolated it would be brighter in the middle of an incident patch
/// than at its edge, and some views brighter than the light. So the mean itself takes the place of the interpolation
/// where that would be about twice as bright in the middle.
class PatchMatrix {
 public:
  /// `means` of incident patch i and outgoing patch o are at [i * size + o].
  PatchMatrix(Patches patches, std::vector<std::array<float, 3>> means);
  /// Angles in degrees, in the file's frame.
  Rgb<double> eval(double theta_i, double phi_i, double theta_o, double phi_o) const;

 private:
  Patches patches_;
  std::vector<std::array<float, 3>> centres_, scale_, constant_;
};

}  // namespace brdfc::measured
