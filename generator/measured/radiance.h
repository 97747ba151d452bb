// SPDX-License-Identifier: GPL-3.0-or-later
// BSDFs as XML: the files of Radiance (genBSDF, bsdf2klems, bsdf2ttree), of LBNL's WINDOW and of its Complex Glazing
// Database. The schema is http://windows.lbl.gov/BSDF-v1.4.xsd; what its numbers mean is as Radiance reads them
// (src/common/bsdf.c, bsdf_m.c and bsdf_t.c).
//
// Read are reflections, "Visible" light and, if present, its colour: of matrices over patches (measured/patches.h) and
// of tensor trees (measured/tensor_tree.h).
//
// - Values are the BRDF in 1/sr, whatever ScatteringDataType says: it is BTDF in most files.
// - IncidentDataStructure Columns: a column of the matrix is an incident patch, and the text has it row by row. Rows: a
//   row is one.
// - Outgoing directions are (theta, phi). Incident ones are where the light goes, so that it comes from (theta, phi +
//   180): a mirror reflects patch i into patch i.
// - The x and y axes are those of a pane whose z axis points into the room, y up. "Back" is the side of the room,
//   "Front" the other. The frame of a side here has z away from the surface and y up.
// - CIE-X, CIE-Z, CIE-u and CIE-v are made from Radiance's RGB with equal-energy white, whatever SourceSpectrum says: a
//   grey surface has X = Y = Z. They are converted back. The primaries are those of Rec.709 but for 0.01 of green's x,
//   and Radiance's pictures show them as such; so RGB is taken for linear Rec.709 here.
#pragma once

#include "measured/measurement.h"

namespace brdfc::measured {

Measurement read_radiance(const std::filesystem::path&);

}  // namespace brdfc::measured
