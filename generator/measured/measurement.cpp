// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/measurement.h"

#include <algorithm>
#include <cctype>

#include "core/error.h"
#include "core/text.h"
#include "measured/alta.h"
#include "measured/csv_grid.h"
#include "measured/merl.h"
#include "measured/radiance.h"
#include "measured/rgl.h"
#include "measured/utia.h"

namespace brdfc::measured {

namespace {

Measurement read(const std::filesystem::path& path, const ToRgb& to_rgb) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (extension == ".binary") return read_merl(path);
  if (extension == ".bsdf") return read_rgl(path, to_rgb);
  if (extension == ".bin") return read_utia(path);
  if (extension == ".alta" || extension == ".dat") return read_alta(path);
  if (extension == ".xml") return read_radiance(path);
  if (extension == ".csv") return read_csv_grid(path);
  input_error("{}: expected a name that ends with one of {}: MERL, RGL, UTIA, ALTA, Radiance or a table", path.string(),
              join(kExtensions, ", "));
}

}  // namespace

Measurement read_measurement(const std::filesystem::path& path, const ToRgb& to_rgb) {
  Measurement m = read(path, to_rgb);
  if (!(m.largest > 0)) input_error("{}: expected a number above 0, found none: the data are black", m.file);
  return m;
}

void require_enough_to_fit(const Measurement& m) {
  if (m.pairs && *m.pairs < kFewestPairs)
    input_error("{}: expected at least {} pairs of directions to fit something to, found {}", m.file, kFewestPairs,
                *m.pairs);
}

double largest(const std::vector<std::array<float, 3>>& values) {
  double out = 0;
  for (const auto& value : values)
    for (const float v : value)
      if (v > out) out = v;
  return out;
}

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace brdfc::measured
