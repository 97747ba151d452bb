// SPDX-License-Identifier: GPL-3.0-or-later
// The MERL database's .binary files: an isotropic BRDF over half and difference angles.
//
// A header of three 32-bit integers, 90, 90, 180, is followed by planes of doubles for red, green and blue, which are
// 1500, 1500 / 1.15 and 1500 / 1.66 times the BRDF. In a plane the index of phi_d runs fastest, then that of theta_d,
// then that of theta_h. theta_h is divided by square root, so that highlights have more cells; phi_d is modulo pi,
// which reciprocity allows. W. Matusik's reading code defines all of it.
//
// An entry is taken for the value in the middle of its cell, and values in between are interpolated. An entry that is
// negative, or that is 0 in a cell whose middle is below the horizon, was not measured. Those above the horizon are
// filled (measured/gaps.h).
#pragma once

#include <array>
#include <cstddef>

#include "measured/measurement.h"

namespace brdfc::measured {

inline constexpr std::size_t kMerlThetaH = 90, kMerlThetaD = 90, kMerlPhiD = 180;
inline constexpr std::size_t kMerlEntries = kMerlThetaH * kMerlThetaD * kMerlPhiD;
inline constexpr std::array<double, 3> kMerlScales{1 / 1500., 1.15 / 1500, 1.66 / 1500};

/// S. Rusinkiewicz: A New Change of Variables for Efficient BRDF Representation, EGWR 1998. Angles of the half vector
/// and of wi about it, in radians; the half vector's azimuth is left out.
struct HalfDifference {
  double theta_h, theta_d, phi_d;
};
HalfDifference half_difference(const Vec3<double>& wi, const Vec3<double>& wo);
/// A pair of directions with these angles, whose half vector has azimuth 0. Either may be below the surface.
std::array<Vec3<double>, 2> directions(const HalfDifference&);

/// The angles in the middle of a cell, and the entry of the cell that contains these angles.
HalfDifference merl_angles(std::size_t entry);
std::size_t merl_entry(const HalfDifference&);

Measurement read_merl(const std::filesystem::path&);

}  // namespace brdfc::measured
