// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/angle_rows.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "core/text.h"

namespace brdfc::measured {
namespace {

/// Angles are told apart in these steps, in degrees.
constexpr double kStep = 1e-4;
/// Rows of the direction along the normal may differ by this share without a note.
constexpr double kAlike = 1e-3;
/// Between azimuths that are farther apart, in degrees, most of what a BRDF does is not measured.
constexpr double kWide = 90;

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

std::vector<double> axis_of(const std::set<long>& values) {
  std::vector<double> out;
  for (const long v : values) out.push_back(degrees(v));
  return out;
}

/// Whether all are the same numbers, or all NaN.
bool same(const std::array<float, 3>& a, const std::array<float, 3>& b) {
  return a == b || (std::isnan(a[0]) && std::isnan(b[0]));
}

}  // namespace

long steps(double degrees) { return std::lround(degrees / kStep); }
double degrees(long steps) { return double(steps) * kStep; }

double degrees_of_radians(double radians) {
  const double degrees = radians * 180 / kPi, whole = std::round(degrees);
  return std::abs(degrees - whole) < double(kRounding) / 2 * kStep ? whole : degrees;
}

std::array<long, 2> angles_of(double theta, double phi) {
  const long circle = steps(360), p = steps(phi - 360 * std::floor(phi / 360));
  return {steps(theta), p == circle ? 0 : p};
}
std::array<long, 2> angles_of(const Vec3<double>& w) {
  const double s = std::sqrt(sin2_theta(w));
  return angles_of(std::atan2(s, w.z) * 180 / kPi, s > 1e-9 ? std::atan2(w.y, w.x) * 180 / kPi : 0);
}

void AngleRows::Entry::add(const std::array<float, 3>& value) {
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = double(value[c]);
    sum[c] += v;
    least[c] = count ? std::min(least[c], v) : v;
    most[c] = count ? std::max(most[c], v) : v;
  }
  ++count;
}
std::array<float, 3> AngleRows::Entry::mean() const {
  const auto at = [&](std::size_t c) { return float(sum[c] / count); };
  return {at(0), at(1), at(2)};
}
double AngleRows::Entry::spread() const {
  double out = 0;
  for (std::size_t c = 0; c < 3; ++c)
    if (sum[c] > 0) out = std::max(out, (most[c] - least[c]) * count / sum[c]);
  return out;
}

bool AngleRows::matters(const Angles& a, std::size_t k) const {
  return k % 2 == 0 || a[k - 1] != 0 || !poles_.contains(k - 1);
}

Angles AngleRows::without_poles(Angles a) const {
  for (const std::size_t k : {1, 3})
    if (!matters(a, k)) a[k] = 0;
  return a;
}

std::string AngleRows::say(const Angles& a) const {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < 4; ++k)
    if (*names_[k]) out.push_back(fmt::format("{} {}", names_[k], degrees(a[k])));
  return join(out, ", ");
}

void AngleRows::remove_rounding() {
  for (std::size_t k = 0; k < 4; ++k) {
    std::set<long> values;
    for (AngleRow& row : given_) {
      if (k % 2 == 1 && row.angles[k] > steps(360) - kRounding) row.angles[k] = 0;
      if (matters(row.angles, k)) values.insert(row.angles[k]);
    }
    const auto rounded = without_rounding(values);
    for (AngleRow& row : given_)
      if (matters(row.angles, k)) row.angles[k] = rounded.at(row.angles[k]);
  }
}

void AngleRows::collect() {
  if (given_.empty()) input_error("{}: expected rows below the header, found none", file_);
  std::map<Angles, const AngleRow*> first;
  for (const AngleRow& row : given_) {
    const Angles& a = row.angles;
    const auto [at, is_new] = first.emplace(a, &row);
    const bool several = row.vector && without_poles(a) == a &&
                         std::ranges::any_of(poles_, [&](std::size_t pole) { return a[pole] == 0; });
    if (!is_new && !several) {
      if (same(at->second->value, row.value)) continue;
      input_error("{} line {}: expected each combination of angles once, or the same values: {} is in line {}, too{}",
                  file_, row.line, say(a), at->second->line,
                  row.wrapped || at->second->wrapped ? ": azimuths a full turn apart are the same" : "");
    }
    rows_[without_poles(a)].add(row.value);
    for (std::size_t k = 0; k < 4; ++k)
      if (matters(a, k)) found_[k].insert(a[k]);
  }
  for (std::set<long>& values : found_)
    if (values.empty()) values.insert(0);
}

std::vector<std::array<float, 3>> AngleRows::values(bool (*may_lack)(const std::array<double, 4>&)) const {
  // Rows can be shared only where theta is 0, which at least a quarter of the combinations are not. Of half and
  // difference angles, most combinations may be below the horizon.
  const std::size_t most = (may_lack ? 64 : 4) * rows_.size();
  std::size_t entries = 1;
  std::vector<std::string> sizes;
  for (std::size_t k = 0; k < 4; ++k) {
    entries *= found_[k].size();
    if (*names_[k]) sizes.push_back(fmt::format("{} {}", found_[k].size(), names_[k]));
  }
  const auto fail = [&](const std::string& more) {
    input_error("{}: expected a row for every combination of angles: {}{}", file_, join(sizes, ", "), more);
  };
  std::size_t room = 1;
  for (const auto& axis : found_)
    if ((room *= axis.size()) > most) fail(fmt::format(", found {} rows", rows_.size()));
  std::vector<std::array<float, 3>> out(entries);
  std::size_t missing = 0, at = 0;
  Angles first{};
  for (const long a : found_[0])
    for (const long b : found_[1])
      for (const long c : found_[2])
        for (const long d : found_[3]) {
          const Angles angles{a, b, c, d};
          if (const auto found_at = rows_.find(without_poles(angles)); found_at != rows_.end())
            out[at] = found_at->second.mean();
          else if (may_lack && may_lack({degrees(a), degrees(b), degrees(c), degrees(d)}))
            out[at].fill(NAN);
          else if (missing++ == 0)
            first = angles;
          ++at;
        }
  if (missing) fail(fmt::format("; {} missing, the first {}", counted(missing, "is", "are"), say(first)));
  return out;
}

std::optional<std::string> AngleRows::contradiction() const {
  double spread = 0;
  for (const auto& [angles, entry] : rows_) spread = std::max(spread, entry.spread());
  if (spread > kAlike)
    return fmt::format("rows of one direction along the normal differ by up to {} %: their mean is taken",
                       in_percent(spread));
  return std::nullopt;
}

bool vary(const std::vector<std::array<float, 3>>& values, const std::array<std::size_t, 4>& sizes, std::size_t along) {
  std::size_t stride = 1;
  for (std::size_t k = along + 1; k < 4; ++k) stride *= sizes[k];
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i / stride % sizes[along] != 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      float least = INFINITY, most = 0;
      for (std::size_t k = 0; k < sizes[along]; ++k)
        if (const float v = values[i + k * stride][c]; !std::isnan(v))
          least = std::min(least, v), most = std::max(most, v);
      if (most - least > float(kAlike) * most) return true;
    }
  }
  return false;
}

void add_gaps(const char* name, const std::vector<double>& at, double turn, bool vary,
              std::vector<std::string>& notes) {
  struct Gap {
    double from, to;
    double width() const { return to - from; }
  };
  std::vector<Gap> gaps;
  for (std::size_t k = 0; k + 1 < at.size(); ++k) gaps.push_back({at[k], at[k + 1]});
  if (turn > 0) gaps.push_back({at.back(), at[0] + turn});
  std::vector<double> widths{0, 0};
  for (const Gap& gap : gaps) widths.push_back(gap.width());
  std::ranges::sort(widths, std::greater{});
  const double widest = widths[0], next = widths[1];
  std::vector<std::string> said;
  for (const Gap& gap : gaps)
    if ((turn > 0 && gap.width() == widest && widest > 2 * next) || (vary && gap.width() > kWide))
      said.push_back(fmt::format("{:g} to {:g}", gap.from, gap.to));
  if (!said.empty())
    notes.push_back(
        fmt::format("{}: nothing was measured from {} degrees: linear between these", name, join(said, ", from ")));
}

void read_grid_of_directions(const AngleRows& rows, Measurement& out) {
  std::vector<std::string>& notes = out.notes;
  auto table = std::make_shared<GridTable>();
  AngleAxis* axes[] = {&table->theta_i, &table->phi_i, &table->theta_o, &table->phi_o};
  for (std::size_t k = 0; k < 4; ++k) axes[k]->at = axis_of(rows.axis(k));
  const bool isotropic = table->phi_i.at.size() == 1;
  if (isotropic && table->phi_i.at[0] != 0)
    input_error("{}: phi_i: expected 0 where it has one value, got {}", rows.file(), table->phi_i.at[0]);
  table->mirrored = isotropic && table->phi_o.at.back() <= 180;
  table->phi_i.ends = AngleAxis::Ends::Circle;
  table->phi_o.ends = table->mirrored ? AngleAxis::Ends::Constant : AngleAxis::Ends::Circle;
  table->values = rows.values();
  if (const auto said = rows.contradiction()) notes.push_back(*said);
  for (const auto& [axis, title] : {std::pair(&table->theta_i, "theta_i"), std::pair(&table->theta_o, "theta_o")})
    if (axis->at[0] > 0)
      notes.push_back(fmt::format("{} begins at {:g} degrees: its values there hold below", title, axis->at[0]));
  const std::array sizes{axes[0]->at.size(), axes[1]->at.size(), axes[2]->at.size(), axes[3]->at.size()};
  if (!isotropic) add_gaps("phi_i", table->phi_i.at, 360, vary(table->values, sizes, 1), notes);
  add_gaps("phi_o", table->phi_o.at, table->mirrored ? 0 : 360, vary(table->values, sizes, 3), notes);
  if (table->mirrored) {
    notes.emplace_back("phi_o lies within half a circle: the other half is taken for its mirror image");
    if (table->phi_o.at[0] > 0 || table->phi_o.at.back() < 180)
      notes.push_back(fmt::format("phi_o: measured from {:g} to {:g} degrees: the values at these ends hold beyond",
                                  table->phi_o.at[0], table->phi_o.at.back()));
  }
  out.grid = fmt::format("{} x {} directions of light, {} x {} of view", table->theta_i.at.size(),
                         table->phi_i.at.size(), table->theta_o.at.size(), table->phi_o.at.size());
  out.isotropic = isotropic;
  out.highest = std::min(table->theta_i.at.back(), table->theta_o.at.back());
  out.largest = largest(table->values);
  out.table = std::move(table);
}

}  // namespace brdfc::measured
