// SPDX-License-Identifier: GPL-3.0-or-later
// Files of a refractive index n + i k over the wavelength: what stands in them, before it is checked.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace brdfc::inline model {

/// A value at a wavelength, in the unit of the file, and its line.
struct OpticalRow {
  double wavelength, value;
  int line;
};

struct OpticalFile {
  std::string label, source;  ///< empty if the file has none
  std::vector<OpticalRow> n, k;
};

/// True for the names of such files.
bool is_optical_file(std::string name);

/// Reads an export of refractiveindex.info, or a file of its database (YAML): tables, and the formulas 1, 2, 3, 5 and
/// 6, which are sums. Throws InputError naming file, line and what was expected.
OpticalFile read_optical_file(const std::filesystem::path&);

}  // namespace brdfc::inline model
