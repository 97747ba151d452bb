// SPDX-License-Identifier: GPL-3.0-or-later
// RGL's .bsdf files. J. Dupuy, W. Jakob: An Adaptive Parameterization for Efficient Material Acquisition and Rendering,
// SIGGRAPH Asia 2018.
//
// The half vector is warped to a unit square by the distribution of normals that the direction theta_i, phi_i sees
// (vndf), and there the data are smooth: spectra(square) ndf(half vector) / (4 sigma(theta_i)) is f times the cosine of
// the other direction. Here theta_i, phi_i is the viewer, as in Mitsuba's plug-in `measured`.
#pragma once

#include "measured/measurement.h"

namespace brdfc::measured {

Measurement read_rgl(const std::filesystem::path&, const ToRgb& to_rgb);

}  // namespace brdfc::measured
