// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/spectrum.h"

#include <fstream>

#include "core/csv.h"
#include "core/data_dir.h"
#include "core/error.h"

namespace brdfc::inline model {

const std::array<Xyz, kWavelengths>& xyz_weights() {
  static const auto weights = [] {
    const std::string file = data_path("data/color/observer.csv").string();
    std::ifstream in(file);
    CsvReader csv(in, file, {"nm", "x", "y", "z", "d65"});
    std::array<Xyz, kWavelengths> w;
    Xyz sum{};
    std::vector<double> row;
    for (std::size_t i = 0; i < kWavelengths; ++i) {
      const int nm = kWavelengthMin + int(i) * kWavelengthStep;
      if (csv.empty() || !csv.next(row) || row[0] != nm) input_error("{}: expected a row for {} nm", file, nm);
      for (std::size_t c = 0; c < 3; ++c) {
        w[i][c] = row[1 + c] * row[4];
        sum[c] += w[i][c];
      }
    }
    for (Xyz& v : w)
      for (std::size_t c = 0; c < 3; ++c) v[c] /= sum[c];
    return w;
  }();
  return weights;
}

Xyz xyz_of(const std::function<double(double nm)>& spectrum) {
  Xyz out{};
  for (std::size_t i = 0; i < kWavelengths; ++i) {
    const double value = spectrum(kWavelengthMin + double(i) * kWavelengthStep);
    for (std::size_t c = 0; c < 3; ++c) out[c] += xyz_weights()[i][c] * value;
  }
  return out;
}

}  // namespace brdfc::inline model
