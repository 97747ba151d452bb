// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/csv_grid.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <span>
#include <sstream>

#include "core/csv.h"
#include "core/error.h"
#include "core/text.h"
#include "core/text_file.h"
#include "measured/angle_rows.h"
#include "measured/binary_file.h"

namespace brdfc::measured {
namespace {

/// The directions of a table, and the units of their angles.
enum class Columns { Vectors, Angles, Degrees, Radians };
const std::vector<std::string>& names_of(Columns columns) {
  static const std::vector<std::string> names[] = {split_fields("wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,r,g,b"),
                                                   split_fields("theta_i,phi_i,theta_o,phi_o,r,g,b"),
                                                   split_fields("theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,r,g,b"),
                                                   split_fields("theta_i_rad,phi_i_rad,theta_o_rad,phi_o_rad,r,g,b")};
  return names[std::size_t(columns)];
}

/// What the first column of a table of its kind says; angles where there is none.
Columns columns_of(const std::string& text) {
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    const std::optional<std::string> comment = comment_of(line);
    const auto header = split_header(comment.value_or(line));
    for (const Columns c : {Columns::Vectors, Columns::Degrees, Columns::Radians})
      if (std::find(header.begin(), header.end(), names_of(c)[0]) != header.end()) return c;
    if (!comment && !trim(line).empty()) break;
  }
  return Columns::Angles;
}

/// Whether angles that are taken for degrees are likely to be radians: all are small, and some of each kind that
/// matters are not 0. A highlight measured within 1.5 degrees of the normal alone is not a BRDF.
bool look_like_radians(const AngleRows& rows) {
  const auto within = [](const std::set<long>& values, double most) {
    return values.empty() || degrees(*values.rbegin()) <= most + 1e-3;
  };
  std::set<long> thetas = rows.axis(0);
  thetas.insert(rows.axis(2).begin(), rows.axis(2).end());
  thetas.erase(0);
  return thetas.size() > 1 && within(thetas, kPi / 2) && within(rows.axis(1), 2 * kPi) && within(rows.axis(3), 2 * kPi);
}

}  // namespace

Measurement read_csv_grid(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::ifstream file = open_file(path);
  const std::string text = plain_text({std::istreambuf_iterator<char>(file), {}}, name);
  const Columns kind = columns_of(text);
  std::istringstream in(text);
  const bool vectors = kind == Columns::Vectors;
  const std::vector<std::string>& columns = names_of(kind);
  CsvReader csv(in, name, columns);
  if (csv.empty()) input_error("{}: expected a header with the columns {}", name, join(columns, ","));
  AngleRows rows(name, {"theta_i", "phi_i", "theta_o", "phi_o"}, {0, 2});
  std::size_t negative = 0;
  std::vector<double> row;
  while (csv.next(row)) {
    Angles a;
    bool wrapped = false;  // an azimuth is not from 0 to 360 degrees
    if (vectors) {
      const Vec3<double> wi = csv.unit_vector(row, 0), wo = csv.unit_vector(row, 3);
      if (!(wi.z > 0 && wo.z > 0)) input_error("{}: expected directions above the surface", csv.where());
      const auto i = angles_of(wi), o = angles_of(wo);
      a = {i[0], i[1], o[0], o[1]};
    } else {
      const bool radians = kind == Columns::Radians;
      std::array<double, 4> angle;
      for (std::size_t k = 0; k < 4; ++k) angle[k] = radians ? degrees_of_radians(row[k]) : row[k];
      for (const std::size_t theta : {0, 2})
        if (!(angle[theta] >= 0 && angle[theta] <= 90))
          input_error("{}: {}: expected {}, got {}", csv.where(), columns[theta],
                      radians ? "radians from 0 to pi/2" : "degrees from 0 to 90", row[theta]);
      for (const std::size_t phi : {1, 3})
        if (!(std::abs(angle[phi]) <= 1e6))
          input_error("{}: {}: expected {}, got {}", csv.where(), columns[phi], radians ? "radians" : "degrees",
                      row[phi]);
      const auto i = angles_of(angle[0], angle[1]), o = angles_of(angle[2], angle[3]);
      a = {i[0], i[1], o[0], o[1]};
      for (const std::size_t phi : {1, 3}) wrapped |= angle[phi] < 0 || angle[phi] >= 360;
    }
    std::array<float, 3> value;
    for (std::size_t c = 0; c < 3; ++c) {
      const double v = row[columns.size() - 3 + c];
      if (!std::isfinite(float(v)))
        input_error("{}: {}: expected a number up to 1e38, got {}", csv.where(), columns[columns.size() - 3 + c], v);
      negative += v < 0;
      value[c] = float(std::max(v, 0.));
    }
    rows.add({a, value, csv.line(), wrapped, vectors});
  }
  if (vectors) rows.remove_rounding();
  rows.collect();
  if (kind == Columns::Angles && look_like_radians(rows))
    input_error(
        "{}: theta_i, theta_o: expected degrees, and the largest is {}: name the columns {} for angles in radians, {} "
        "for such small ones",
        name, degrees(std::max(*rows.axis(0).rbegin(), *rows.axis(2).rbegin())),
        join(std::span(names_of(Columns::Radians)).first(4), ","),
        join(std::span(names_of(Columns::Degrees)).first(4), ","));
  Measurement out;
  if (!csv.others().empty())
    out.notes.push_back(fmt::format("{} not known and not read: {}",
                                    csv.others().size() == 1 ? "a column is" : "columns are",
                                    join(csv.others(), ", ")));
  if (negative)
    out.notes.push_back(fmt::format("{} negative: taken for 0", counted(negative, "number is", "numbers are")));
  read_grid_of_directions(rows, out);
  out.file = name;
  out.format = "CSV";
  out.pairs = rows.given().size();
  return out;
}

}  // namespace brdfc::measured
