// SPDX-License-Identifier: GPL-3.0-or-later
// Particles from the lamps, each scattering joined to the camera: the same picture as the path tracer's, found from the
// other end. J. Arvo, Backward Ray Tracing, 1986; P. Dutre, E. Lafortune, Y. Willems, Monte Carlo Light Tracing with
// Direct Computation of Pixel Intensities, 1993.
//
// The directions of a BRDF have roles, wi to the light and wo to the viewer. A method that goes from the lamps knows wi
// and draws wo. Models can only draw wi, and a program that trusts reciprocity takes that for granted and swaps the
// two; of a model that is not reciprocal it then renders another surface, which is what the papers on reflection argue
// with. Both ways are here.
//
// Interpolated normals: light arrives on the triangle and reflects about the normal, which multiplies what arrives by
// the ratio of both cosines (E. Veach, Robust Monte Carlo Methods for Light Transport Simulation, 1997, section 5.3).
// They are not bent as the path tracer bends them, which depends on the viewer: of meshes of few faces that are shaded
// smooth its pictures of polished models are others.
#pragma once

#include "reference/render.h"

namespace brdfc::reference {

/// As render() with Origin::Lamps or LampsSwapped. A sample a pixel is here as many particles as there are pixels; what
/// the camera sees of lamps and the environment themselves is found with as many rays from the camera. Throws
/// InputError that names a material or object which no particle shows to a camera, a mirror or one that lets light
/// through, or which none reaches, one for the camera alone.
RenderResult render_from_lamps(const Scene& scene, const RenderOptions& options);

}  // namespace brdfc::reference
