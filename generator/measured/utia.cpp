// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/utia.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "measured/binary_file.h"
#include "measured/grid_table.h"

namespace brdfc::measured {

Measurement read_utia(const std::filesystem::path& path) {
  constexpr std::size_t kThetas = 6, kPhis = 48, kDirections = kThetas * kPhis, kEntries = kDirections * kDirections;
  constexpr double kThetaStep = 15, kPhiStep = 7.5;
  BinaryFile file(path);
  constexpr std::uint64_t bytes = 3 * kEntries * sizeof(double);
  if (file.size() != bytes)
    input_error("{}: expected {} bytes, 3 planes of {} x {} doubles, got {}{}", file.name(), bytes, kDirections,
                kDirections, file.size(), file.doubt_of_size(bytes, bytes));
  auto table = std::make_shared<GridTable>();
  for (std::size_t i = 0; i < kThetas; ++i) table->theta_i.at.push_back(kThetaStep * double(i));
  for (std::size_t i = 0; i < kPhis; ++i) table->phi_i.at.push_back(kPhiStep * double(i));
  table->phi_i.ends = AngleAxis::Ends::Circle;
  table->theta_o = table->theta_i;
  table->phi_o = table->phi_i;
  table->values.resize(kEntries);
  std::size_t negative = 0;
  static constexpr const char* kPlanes[] = {"red", "green", "blue"};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto plane = file.numbers<double>(kEntries, kPlanes[c]);
    for (std::size_t i = 0; i < kEntries; ++i) {
      if (!std::isfinite(float(plane[i])))
        input_error("{}: {}: found {} in row {}, column {}: {}", file.name(), kPlanes[c], plane[i], i / kDirections,
                    i % kDirections, expected_instead_of(plane[i]));
      negative += plane[i] < 0;
      table->values[i][c] = float(std::max(plane[i], 0.));
    }
  }
  Measurement out;
  if (negative)
    out.notes.push_back(fmt::format("{} negative, {} %: taken for 0", counted(negative, "number is", "numbers are"),
                                    in_percent(double(negative) / double(3 * kEntries))));
  out.file = file.name();
  out.format = "UTIA";
  out.grid = fmt::format("{0} x {1} directions of light, {0} x {1} of view", kThetas, kPhis);
  out.isotropic = false;
  out.highest = kThetaStep * double(kThetas - 1);
  out.largest = largest(table->values);
  out.table = std::move(table);
  return out;
}

}  // namespace brdfc::measured
