// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/merl.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/text.h"
#include "measured/binary_file.h"
#include "measured/gaps.h"

namespace brdfc::measured {
namespace {

/// Places in units of cells, along the three axes.
struct MerlPlace {
  double h, d, p;
};
MerlPlace place_of(const HalfDifference& a) {
  const double phi_d = a.phi_d < 0 ? a.phi_d + kPi : a.phi_d;
  return {std::sqrt(std::max(a.theta_h, 0.) / (kPi / 2)) * double(kMerlThetaH),
          a.theta_d / (kPi / 2) * double(kMerlThetaD), phi_d / kPi * double(kMerlPhiD)};
}

constexpr std::size_t entry_at(std::size_t h, std::size_t d, std::size_t p) {
  return (h * kMerlThetaD + d) * kMerlPhiD + p;
}

/// The two cells whose middles are beside a place, and the weight of the second.
struct Between {
  std::array<std::size_t, 2> cell;
  double second;
};
Between between(double place, std::size_t cells) {
  const double last = double(cells) - 1, at = std::clamp(place - 0.5, 0., last), floor = std::floor(at);
  const std::size_t first = std::size_t(floor);
  return {{first, std::min(first + 1, cells - 1)}, at - floor};
}
Between around(double place, std::size_t cells) {
  const double at = place - 0.5, floor = std::floor(at);
  const std::size_t first = std::size_t(floor + double(cells)) % cells;
  return {{first, (first + 1) % cells}, at - floor};
}

class Merl final : public Table {
 public:
  /// NaN marks entries that were not measured.
  explicit Merl(std::vector<std::array<float, 3>> values) : values_(std::move(values)) {}

  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    if (!(wi.z > 0 && wo.z > 0)) return Rgb<double>(0);
    const MerlPlace at = place_of(half_difference(wi, wo));
    const Between h = between(at.h, kMerlThetaH), d = between(at.d, kMerlThetaD), p = around(at.p, kMerlPhiD);
    std::array<double, 3> sum{};
    double weights = 0;
    for (int i = 0; i < 8; ++i) {
      const std::size_t ih = i & 1, id = i >> 1 & 1, ip = i >> 2 & 1;
      const double weight =
          (ih ? h.second : 1 - h.second) * (id ? d.second : 1 - d.second) * (ip ? p.second : 1 - p.second);
      const auto& value = values_[entry_at(h.cell[ih], d.cell[id], p.cell[ip])];
      if (!(weight > 0) || std::isnan(value[0])) continue;
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * double(value[c]);
      weights += weight;
    }
    if (!(weights > 0)) return Rgb<double>(0);
    return Rgb<double>(sum[0], sum[1], sum[2]) / weights;
  }

 private:
  std::vector<std::array<float, 3>> values_;
};

/// Fills what was not measured above the horizon.
void fill(std::vector<std::array<float, 3>>& values, const std::vector<bool>& above) {
  // In units of cells, between which the table is linear. phi_d is stretched to a circle, so that its ends meet.
  AngleAxis h, d, p{{}, AngleAxis::Ends::Circle};
  for (std::size_t k = 0; k < kMerlThetaH; ++k) h.at.push_back(double(k));
  for (std::size_t k = 0; k < kMerlThetaD; ++k) d.at.push_back(double(k));
  for (std::size_t k = 0; k < kMerlPhiD; ++k) p.at.push_back(double(k) * 360 / double(kMerlPhiD));
  fill_gaps(values, std::array<const AngleAxis*, 3>{&h, &d, &p}, std::array<std::size_t, 3>{1, 2, 0}, above);
}

bool above_horizon(std::size_t entry) {
  const auto [wi, wo] = directions(merl_angles(entry));
  return wi.z > 0 && wo.z > 0;
}

/// Whether the header's numbers are right when the bytes of each are reversed.
bool reversed(const std::vector<std::int32_t>& size) {
  const auto is = [&](std::size_t k, std::size_t expected) {
    const auto bytes = std::bit_cast<std::array<unsigned char, 4>>(size[k]);
    return (std::size_t(bytes[0]) << 24 | std::size_t(bytes[1]) << 16 | std::size_t(bytes[2]) << 8 | bytes[3]) ==
           expected;
  };
  return is(0, kMerlThetaH) && is(1, kMerlThetaD) && is(2, kMerlPhiD);
}

}  // namespace

HalfDifference half_difference(const Vec3<double>& wi, const Vec3<double>& wo) {
  const Vec3<double> h = normalize(wi + wo);
  const double sinTheta = std::sqrt(sin2_theta(h));
  // Turned about z until h has azimuth 0, then about y until h is the z axis.
  const double cosPhi = sinTheta > 0 ? h.x / sinTheta : 1, sinPhi = sinTheta > 0 ? h.y / sinTheta : 0;
  const Vec3<double> turned = rotate_z(wi, cosPhi, sinPhi);
  const Vec3<double> d{h.z * turned.x - sinTheta * turned.z, turned.y, sinTheta * turned.x + h.z * turned.z};
  // atan2 is exact where acos is not: near the axis.
  return {std::atan2(sinTheta, h.z), std::atan2(std::sqrt(sin2_theta(d)), d.z), std::atan2(d.y, d.x)};
}

std::array<Vec3<double>, 2> directions(const HalfDifference& a) {
  const double s = std::sin(a.theta_h), c = std::cos(a.theta_h), sd = std::sin(a.theta_d), cd = std::cos(a.theta_d);
  const Vec3<double> d{sd * std::cos(a.phi_d), sd * std::sin(a.phi_d), cd};
  const auto turned = [&](const Vec3<double>& v) { return Vec3<double>{c * v.x + s * v.z, v.y, c * v.z - s * v.x}; };
  return {turned(d), turned({-d.x, -d.y, d.z})};
}

HalfDifference merl_angles(std::size_t entry) {
  const double p = double(entry % kMerlPhiD) + 0.5, d = double(entry / kMerlPhiD % kMerlThetaD) + 0.5,
               h = (double(entry / kMerlPhiD / kMerlThetaD) + 0.5) / double(kMerlThetaH);
  return {h * h * (kPi / 2), d / double(kMerlThetaD) * (kPi / 2), p / double(kMerlPhiD) * kPi};
}

std::size_t merl_entry(const HalfDifference& a) {
  const MerlPlace at = place_of(a);
  const auto cell = [](double place, std::size_t cells) { return std::min(std::size_t(place), cells - 1); };
  return entry_at(cell(at.h, kMerlThetaH), cell(at.d, kMerlThetaD), std::size_t(at.p) % kMerlPhiD);
}

Measurement read_merl(const std::filesystem::path& path) {
  BinaryFile file(path);
  const auto size = file.numbers<std::int32_t>(3, "header");
  if (size[0] != int(kMerlThetaH) || size[1] != int(kMerlThetaD) || size[2] != int(kMerlPhiD))
    input_error("{}: header: expected {} x {} x {} values of theta_h, theta_d and phi_d, found {} x {} x {}{}",
                file.name(), kMerlThetaH, kMerlThetaD, kMerlPhiD, size[0], size[1], size[2],
                reversed(size) ? ": the byte order is reversed; little-endian numbers are expected" : "");
  constexpr std::uint64_t doubles = 3 * kMerlEntries * sizeof(double), bytes = 12 + doubles;
  if (file.size() != bytes)
    input_error("{}: expected {} bytes, 3 planes of {} doubles after a header of 12 bytes, got {}{}", file.name(),
                bytes, kMerlEntries, file.size(), file.doubt_of_size(bytes, doubles));
  Measurement out;
  std::vector<std::array<float, 3>> values(kMerlEntries);
  std::vector<unsigned char> negative(kMerlEntries);
  static constexpr const char* kPlanes[] = {"red", "green", "blue"};
  for (std::size_t c = 0; c < 3; ++c) {
    const auto plane = file.numbers<double>(kMerlEntries, kPlanes[c]);
    for (std::size_t i = 0; i < kMerlEntries; ++i) {
      const double value = plane[i] * kMerlScales[c];
      if (!std::isfinite(float(value)))
        input_error("{}: {}: found {} at entry {}, theta_h {}, theta_d {}, phi_d {}: {}", file.name(), kPlanes[c],
                    plane[i], i, i / kMerlPhiD / kMerlThetaD, i / kMerlPhiD % kMerlThetaD, i % kMerlPhiD,
                    expected_instead_of(plane[i]));
      negative[i] += value < 0;
      values[i][c] = float(std::max(value, 0.));
    }
  }
  std::size_t above = 0, holes = 0, clipped = 0;
  std::vector<bool> is_above(kMerlEntries);
  for (std::size_t i = 0; i < kMerlEntries; ++i) {
    const bool dark = values[i][0] == 0 && values[i][1] == 0 && values[i][2] == 0, inside = above_horizon(i);
    // Noise takes single channels below 0; what was not measured is negative in all.
    const bool hole = negative[i] == 3 || (dark && !inside);
    above += inside;
    is_above[i] = inside;
    holes += inside && hole;
    clipped += inside && !hole && negative[i] > 0;
    if (hole) values[i].fill(NAN);
  }
  if (holes == above) input_error("{}: expected values above the horizon, found none", file.name());
  if (holes) {
    fill(values, is_above);
    out.notes.push_back(fmt::format("{} of {} above the horizon are negative, {} %: not measured, {}",
                                    counted(holes, "entry", "entries"), above,
                                    in_percent(double(holes) / double(above)), kFilled));
  }
  if (clipped)
    out.notes.push_back(fmt::format("{} negative in one channel or two: taken for 0 there",
                                    counted(clipped, "entry is", "entries are")));
  out.file = file.name();
  out.format = "MERL";
  out.grid = fmt::format("{} x {} x {} cells of theta_h, theta_d and phi_d", kMerlThetaH, kMerlThetaD, kMerlPhiD);
  out.largest = largest(values);
  out.table = std::make_shared<Merl>(std::move(values));
  return out;
}

}  // namespace brdfc::measured
