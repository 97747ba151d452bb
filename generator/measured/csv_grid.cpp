// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/csv_grid.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "core/csv.h"
#include "core/error.h"
#include "measured/binary_file.h"
#include "measured/grid_table.h"

namespace brdfc::measured {
namespace {

/// Angles are told apart in these steps, in degrees.
constexpr double kStep = 1e-4;
/// Angles of unit vectors with six digits that differ by less, in steps, are the same.
constexpr long kRounding = 100;
/// Rows of the direction along the normal may differ by this share without a note.
constexpr double kAlike = 1e-3;

using Angles = std::array<long, 4>;  // theta_i, phi_i, theta_o, phi_o in steps

long steps(double degrees) { return std::lround(degrees / kStep); }
double degrees(long steps) { return double(steps) * kStep; }

/// The same directions with an azimuth of 0 where theta is 0.
Angles without_pole(Angles a) {
  for (const std::size_t k : {0, 2})
    if (a[k] == 0) a[k + 1] = 0;
  return a;
}

struct Row {
  Angles angles;
  std::array<float, 3> value;
  bool wrapped;  ///< an azimuth is given as one below 0 or from 360 on
  std::string where;
};

/// Rows of one combination of angles. Only rows of the direction along the normal may be several, one an azimuth.
struct Entry {
  std::array<double, 3> sum{}, least, most;
  int count = 0;
  bool wrapped = false;

  void add(const Row& row) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double v = double(row.value[c]);
      sum[c] += v;
      least[c] = count ? std::min(least[c], v) : v;
      most[c] = count ? std::max(most[c], v) : v;
    }
    ++count;
    wrapped |= row.wrapped;
  }
  std::array<float, 3> mean() const { return {at(0), at(1), at(2)}; }
  /// By which share of the mean the rows differ.
  double spread() const {
    double out = 0;
    for (std::size_t c = 0; c < 3; ++c)
      if (most[c] > 0) out = std::max(out, (most[c] - least[c]) * count / sum[c]);
    return out;
  }

 private:
  float at(std::size_t c) const { return float(sum[c] / count); }
};

/// The angles of an axis, of which those that rounding made different are the same.
std::map<long, long> without_rounding(const std::set<long>& values) {
  std::map<long, long> out;
  for (auto first = values.begin(); first != values.end();) {
    auto last = first;
    long sum = *first, count = 1;
    while (std::next(last) != values.end() && *std::next(last) - *last < kRounding) sum += *++last, ++count;
    const long mean = *first < kRounding ? 0 : std::lround(double(sum) / double(count));
    for (++last; first != last; ++first) out[*first] = mean;
  }
  return out;
}

/// Gives angles of unit vectors that rounding made different the same steps.
void remove_rounding(std::vector<Row>& rows) {
  for (std::size_t k = 0; k < 4; ++k) {
    std::set<long> values;
    const auto counts = [&](const Angles& a) { return k % 2 == 0 || a[k - 1] != 0; };
    for (Row& row : rows) {
      if (k % 2 == 1 && row.angles[k] > steps(360) - kRounding) row.angles[k] = 0;
      if (counts(row.angles)) values.insert(row.angles[k]);
    }
    const auto same = without_rounding(values);
    for (Row& row : rows)
      if (counts(row.angles)) row.angles[k] = same.at(row.angles[k]);
  }
}

std::vector<double> axis_of(const std::set<long>& values) {
  std::vector<double> out;
  for (const long v : values) out.push_back(degrees(v));
  return out;
}

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
Columns columns_of(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  while (trim(line).empty() && std::getline(in, line)) {
  }
  const auto header = split_header(line);
  for (const Columns c : {Columns::Vectors, Columns::Degrees, Columns::Radians})
    if (std::find(header.begin(), header.end(), names_of(c)[0]) != header.end()) return c;
  return Columns::Angles;
}

/// Radians of a few digits in degrees: whole degrees stay whole.
double degrees_of_radians(double radians) {
  const double degrees = radians * 180 / kPi, whole = std::round(degrees);
  return std::abs(degrees - whole) < double(kRounding) / 2 * kStep ? whole : degrees;
}

/// Whether angles that are taken for degrees are likely to be radians: all are small, and some of each kind that
/// matters are not 0. A highlight measured within 1.5 degrees of the normal alone is not a BRDF.
bool look_like_radians(const std::array<std::set<long>, 4>& found) {
  const auto within = [](const std::set<long>& values, double most) {
    return values.empty() || degrees(*values.rbegin()) <= most + 1e-3;
  };
  std::set<long> thetas = found[0];
  thetas.insert(found[2].begin(), found[2].end());
  thetas.erase(0);
  return thetas.size() > 1 && within(thetas, kPi / 2) && within(found[1], 2 * kPi) && within(found[3], 2 * kPi);
}

/// `theta` and `phi` in steps, phi in [0, 360).
std::array<long, 2> angles_of(double theta, double phi) {
  const long circle = steps(360), p = steps(phi - 360 * std::floor(phi / 360));
  return {steps(theta), p == circle ? 0 : p};
}
std::array<long, 2> angles_of(const Vec3<double>& w) {
  const double s = std::sqrt(sin2_theta(w));
  return angles_of(std::atan2(s, w.z) * 180 / kPi, s > 1e-9 ? std::atan2(w.y, w.x) * 180 / kPi : 0);
}

/// Sentences on what an axis of angles leaves out.
void add_gaps(const char* name, const std::vector<double>& at, std::vector<std::string>& notes) {
  std::vector<double> gaps;
  for (std::size_t k = 0; k < at.size(); ++k) gaps.push_back((k + 1 < at.size() ? at[k + 1] : at[0] + 360) - at[k]);
  const auto widest = std::ranges::max_element(gaps);
  const std::size_t from = std::size_t(widest - gaps.begin());
  const double width = *widest;
  *widest = 0;
  if (width > 2 * *std::ranges::max_element(gaps))
    notes.push_back(fmt::format("{}: nothing was measured from {:g} to {:g} degrees: linear between these", name,
                                at[from], from + 1 < at.size() ? at[from + 1] : at[0] + 360));
}

}  // namespace

Measurement read_csv_grid(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::ifstream in = open_file(path);
  const Columns kind = columns_of(name);
  const bool vectors = kind == Columns::Vectors;
  const std::vector<std::string>& columns = names_of(kind);
  CsvReader csv(in, name, columns);
  if (csv.empty()) input_error("{}: expected a header with the columns {}", name, fmt::join(columns, ","));
  std::vector<Row> given;
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
    given.push_back({a, value, wrapped, csv.where()});
  }
  if (vectors) remove_rounding(given);
  std::map<Angles, Entry> rows;
  std::array<std::set<long>, 4> found;
  for (const Row& r : given) {
    const Angles& a = r.angles;
    Entry& entry = rows[without_pole(a)];
    const bool pole = a[0] == 0 || a[2] == 0;
    const auto same = [&] { return (entry.wrapped || r.wrapped) && entry.mean() == r.value; };
    if (entry.count > 0 && !pole && !same())
      input_error(
          "{}: expected each combination of angles once: theta_i {}, phi_i {}, theta_o {}, phi_o {} stands twice{}",
          r.where, degrees(a[0]), degrees(a[1]), degrees(a[2]), degrees(a[3]),
          entry.wrapped || r.wrapped ? ", with other values: azimuths a full turn apart are the same" : "");
    entry.add(r);
    for (std::size_t k = 0; k < 4; ++k)
      if (k % 2 == 0 || a[k - 1] != 0) found[k].insert(a[k]);
  }
  if (rows.empty()) input_error("{}: expected rows below the header, found none", name);
  if (kind == Columns::Angles && look_like_radians(found))
    input_error(
        "{}: theta_i, theta_o: expected degrees, and the largest is {}: name the columns {} for angles in radians, {} "
        "for such small ones",
        name, degrees(std::max(*found[0].rbegin(), *found[2].rbegin())),
        fmt::join(names_of(Columns::Radians).begin(), names_of(Columns::Radians).begin() + 4, ","),
        fmt::join(names_of(Columns::Degrees).begin(), names_of(Columns::Degrees).begin() + 4, ","));
  for (std::set<long>& values : found)
    if (values.empty()) values.insert(0);

  auto table = std::make_shared<GridTable>();
  AngleAxis* axes[] = {&table->theta_i, &table->phi_i, &table->theta_o, &table->phi_o};
  // Rows can be shared only where theta is 0, which at least a quarter of the combinations are not.
  const std::size_t most = 4 * rows.size();
  std::size_t entries = 1;
  for (std::size_t k = 0; k < 4; ++k) {
    axes[k]->at = axis_of(found[k]);
    entries *= found[k].size();
    if (entries > most)
      input_error(
          "{}: expected a row for every combination of angles: {} theta_i, {} phi_i, {} theta_o and {} phi_o, "
          "found {} rows",
          name, found[0].size(), found[1].size(), found[2].size(), found[3].size(), rows.size());
  }
  Measurement out;
  if (!csv.others().empty())
    out.notes.push_back(fmt::format("{} not known and not read: {}",
                                    csv.others().size() == 1 ? "a column is" : "columns are",
                                    fmt::join(csv.others(), ", ")));
  const bool isotropic = found[1].size() == 1;
  if (isotropic && *found[1].begin() != 0)
    input_error("{}: phi_i: expected 0 where it has one value, got {}", name, degrees(*found[1].begin()));
  table->mirrored = isotropic && table->phi_o.at.back() <= 180;
  table->phi_i.ends = AngleAxis::Ends::Circle;
  table->phi_o.ends = table->mirrored ? AngleAxis::Ends::Constant : AngleAxis::Ends::Circle;
  table->values.resize(entries);
  std::size_t missing = 0, at = 0;
  Angles first{};
  for (const long ti : found[0])
    for (const long pi : found[1])
      for (const long to : found[2])
        for (const long po : found[3]) {
          const Angles angles{ti, pi, to, po};
          if (const auto found_at = rows.find(without_pole(angles)); found_at != rows.end())
            table->values[at] = found_at->second.mean();
          else if (missing++ == 0)
            first = angles;
          ++at;
        }
  if (missing)
    input_error(
        "{}: expected a row for every combination of angles; {} missing, the first theta_i {}, phi_i {}, "
        "theta_o {}, phi_o {}",
        name, counted(missing, "is", "are"), degrees(first[0]), degrees(first[1]), degrees(first[2]),
        degrees(first[3]));
  if (negative)
    out.notes.push_back(fmt::format("{} negative: taken for 0", counted(negative, "number is", "numbers are")));
  double spread = 0;
  for (const auto& [angles, entry] : rows) spread = std::max(spread, entry.spread());
  if (spread > kAlike)
    out.notes.push_back(fmt::format(
        "rows of one direction along the normal differ by up to {:.2g} %: their mean is taken", 100 * spread));
  for (const auto& [axis, title] : {std::pair(&table->theta_i, "theta_i"), std::pair(&table->theta_o, "theta_o")})
    if (axis->at[0] > 0)
      out.notes.push_back(fmt::format("{} begins at {:g} degrees: its values there hold below", title, axis->at[0]));
  if (!isotropic) add_gaps("phi_i", table->phi_i.at, out.notes);
  if (table->mirrored) {
    out.notes.emplace_back("phi_o lies within half a circle: the other half is taken for its mirror image");
    if (table->phi_o.at[0] > 0 || table->phi_o.at.back() < 180)
      out.notes.push_back(fmt::format("phi_o: measured from {:g} to {:g} degrees: the values at these ends hold beyond",
                                      table->phi_o.at[0], table->phi_o.at.back()));
  } else {
    add_gaps("phi_o", table->phi_o.at, out.notes);
  }
  out.file = name;
  out.format = "CSV";
  out.grid = fmt::format("{} x {} directions of light, {} x {} of view", found[0].size(), found[1].size(),
                         found[2].size(), found[3].size());
  out.isotropic = isotropic;
  out.highest = std::min(table->theta_i.at.back(), table->theta_o.at.back());
  out.table = std::move(table);
  return out;
}

}  // namespace brdfc::measured
