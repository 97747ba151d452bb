// SPDX-License-Identifier: GPL-3.0-or-later
// Light tracing: particles start at the lamps, and each scattering event is connected to the camera. The picture is
// that of the path tracer. J. Arvo, Backward Ray Tracing, 1986; P. Dutre, E. Lafortune, Y. Willems, Monte Carlo Light
// Tracing with Direct Computation of Pixel Intensities, 1993.
//
// The two directions of a BRDF have roles: wi points to the light, wo to the viewer. A light tracer knows wi and has to
// sample wo, but models can only sample wi. Renderers that rely on reciprocity swap the two. For a model that is not
// reciprocal they then render another surface, a point that papers on reflection models argue with. Both variants are
// implemented here.
//
// Interpolated normals: light arrives at the triangle and is reflected about the interpolated normal, so the incident
// light is multiplied by the ratio of the two cosines (E. Veach, Robust Monte Carlo Methods for Light Transport
// Simulation, 1997, section 5.3). The normals are not bent as in the path tracer, because bending depends on the
// viewer. For smooth-shaded meshes of few faces, pictures of polished models therefore differ.
#pragma once

#include "reference/render.h"

namespace brdfc::reference {

/// Implements render() for Origin::Lamps and Origin::LampsSwapped. One sample per pixel means as many particles as
/// there are pixels. Lamps and the environment, as seen directly by the camera, are found with the same number of
/// camera rays. Throws InputError that names a material that can't be connected to the camera (a mirror, or one that
/// lets light through), or an object that particles can't reach (one that is for the camera only).
RenderResult render_from_lamps(const Scene& scene, const RenderOptions& options);

}  // namespace brdfc::reference
