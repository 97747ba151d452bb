// SPDX-License-Identifier: GPL-3.0-or-later
// Files of a refractive index n + i k over the wavelength: what stands in them, before it is checked.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace brdfc::inline model {

/// A value at a wavelength, in um or the unit that nobody states, and its line.
struct OpticalRow {
  double wavelength, value;
  int line;
};

struct OpticalFile {
  std::string label, source;  ///< empty if the file has none
  std::vector<OpticalRow> n, k;
  bool in_um = false;  ///< the file states a unit, so that wavelengths are in um
};

/// True for the names of such files.
bool is_optical_file(std::string name);

/// Reads an export of refractiveindex.info or another table with a header; a file of that site's database (YAML),
/// tables and all of its formulas; or spectra as pbrt and Mitsuba have them: NAME.eta.spd, with NAME.k.spd beside it if
/// there is one. Throws InputError naming file, line and what was expected.
OpticalFile read_optical_file(const std::filesystem::path&);

}  // namespace brdfc::inline model
