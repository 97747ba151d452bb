// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/measurement.h"

#include <algorithm>
#include <cctype>

#include "core/error.h"
#include "measured/csv_grid.h"
#include "measured/merl.h"
#include "measured/rgl.h"
#include "measured/utia.h"

namespace brdfc::measured {

Measurement read_measurement(const std::filesystem::path& path, const ToRgb& to_rgb) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (extension == ".binary") return read_merl(path);
  if (extension == ".bsdf") return read_rgl(path, to_rgb);
  if (extension == ".bin") return read_utia(path);
  if (extension == ".csv") return read_csv_grid(path);
  input_error("{}: expected a name that ends with one of {}: MERL, RGL, UTIA or a table", path.string(),
              fmt::join(kExtensions, ", "));
}

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace brdfc::measured
