// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/patches.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "measured/grid_table.h"

namespace brdfc::measured {
namespace {

/// Changes of the values at the centres. More of them hardly make interpolated lobes better, and noise larger.
constexpr int kRounds = 4;
/// How many times as bright as its mean the middle of a pair of patches may be: from the first number on the mean
/// replaces a part of the interpolation, from the second on all of it.
constexpr double kPeak = 1.5, kHighestPeak = 2.5;
/// Places at which a patch's mean is taken: along theta on each side of the centre, and along phi.
constexpr int kThetas = 8, kPhis = 32;

using Values = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Means = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// What each centre contributes to the mean of a patch by interpolation.
Means means_of(const Patches& patches) {
  std::vector<Eigen::Triplet<double>> entries;
  std::size_t patch = 0;
  for (const Patches::Ring& ring : patches.rings()) {
    // Places of equal projected solid angle, which is proportional to sin^2 theta.
    const auto sin2 = [](double degrees) { return std::pow(std::sin(degrees / kDegrees), 2); };
    const double middle = (ring.from + ring.to) / 2, all = sin2(ring.to) - sin2(ring.from);
    for (std::size_t k = 0; k < ring.number; ++k, ++patch)
      for (const auto& [from, to] : {std::pair(ring.from, middle), std::pair(middle, ring.to)}) {
        const double first = sin2(from), part = sin2(to) - first;
        for (int t = 0; t < kThetas; ++t)
          for (int p = 0; p < kPhis; ++p) {
            const double theta = kDegrees * std::asin(std::sqrt(first + part * (t + 0.5) / kThetas)),
                         phi = 360 * (double(k) - 0.5 + (p + 0.5) / kPhis) / double(ring.number);
            const Patches::Around around = patches.around(theta, phi);
            for (std::size_t i = 0; i < 4; ++i)
              entries.emplace_back(int(patch), int(around.patch[i]), around.weight[i] * part / (all * kThetas * kPhis));
          }
      }
  }
  Means out(Eigen::Index(patches.size()), Eigen::Index(patches.size()));
  out.setFromTriplets(entries.begin(), entries.end());  // which adds entries of one place
  return out;
}

}  // namespace

Patches::Patches(std::string name, std::vector<Ring> rings) : name_(std::move(name)), rings_(std::move(rings)) {
  for (const Ring& ring : rings_) {
    first_.push_back(size_);
    // A single patch about the normal has the normal as its centre.
    centres_.push_back(ring.number == 1 && ring.from == 0 ? 0 : (ring.from + ring.to) / 2);
    size_ += ring.number;
  }
}

const std::vector<Patches>& Patches::known() {
  static const std::vector<Patches> known = [] {
    const auto make = [](const char* name, const std::vector<double>& theta, const std::vector<std::size_t>& number) {
      std::vector<Ring> rings;
      for (std::size_t i = 0; i < number.size(); ++i) rings.push_back({theta[i], theta[i + 1], number[i]});
      return Patches(name, std::move(rings));
    };
    return std::vector<Patches>{
        make("LBNL/Klems Full", {0, 5, 15, 25, 35, 45, 55, 65, 75, 90}, {1, 8, 16, 20, 24, 24, 24, 16, 12}),
        make("LBNL/Klems Half", {0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5, 90}, {1, 8, 12, 16, 20, 12, 8}),
        make("LBNL/Klems Half", {0, 6.5, 19.5, 32.5, 46.5, 61.5, 76.5, 90}, {1, 8, 12, 16, 20, 12, 4}),
        make("LBNL/Klems Quarter", {0, 9, 27, 45, 63, 90}, {1, 8, 12, 12, 8}),
        make("LBNL/Klems Quarter", {0, 9, 27, 46, 66, 90}, {1, 8, 12, 12, 8})};
  }();
  return known;
}

std::size_t Patches::ring(double theta) const {
  std::size_t out = 0;
  while (out + 1 < rings_.size() && theta >= rings_[out].to) ++out;
  return out;
}

std::size_t Patches::patch(double theta, double phi) const {
  const std::size_t r = ring(theta), number = rings_[r].number;
  const double turns = phi / 360 - std::floor(phi / 360);
  return first_[r] + std::size_t(turns * double(number) + 0.5) % number;
}

Patches::Around Patches::around(double theta, double phi) const {
  const std::size_t upper = std::size_t(std::upper_bound(centres_.begin(), centres_.end(), theta) - centres_.begin());
  const std::size_t second = std::min(upper, centres_.size() - 1), first = upper > 0 ? upper - 1 : 0;
  const double weight =
      first == second ? 0 : std::clamp((theta - centres_[first]) / (centres_[second] - centres_[first]), 0., 1.);
  Around out;
  const double turns = phi / 360 - std::floor(phi / 360);
  for (const std::size_t k : {0, 1}) {
    const std::size_t r = k ? second : first, number = rings_[r].number;
    const double place = turns * double(number), floor = std::floor(place), of_ring = k ? weight : 1 - weight;
    out.patch[2 * k] = first_[r] + std::size_t(floor) % number;
    out.patch[2 * k + 1] = first_[r] + (std::size_t(floor) + 1) % number;
    out.weight[2 * k] = of_ring * (1 - (place - floor));
    out.weight[2 * k + 1] = of_ring * (place - floor);
  }
  return out;
}

double Patches::widest() const {
  double out = 0;
  for (std::size_t i = 0; i < rings_.size(); ++i) {
    const Ring& ring = rings_[i];
    out = std::max({out, (ring.to - ring.from) * (centres_[i] == 0 ? 2 : 1),
                    360 / double(ring.number) * std::sin(centres_[i] / kDegrees)});
  }
  return out;
}

PatchMatrix::PatchMatrix(Patches patches, std::vector<std::array<float, 3>> means)
    : patches_(std::move(patches)), centres_(means), scale_(means.size()), constant_(means.size()) {
  const Eigen::Index size = Eigen::Index(patches_.size());
  const Means mean = means_of(patches_);
  for (std::size_t c = 0; c < 3; ++c) {
    Values given(size, size);
    for (Eigen::Index i = 0; i < size * size; ++i) given.data()[i] = double(means[std::size_t(i)][c]);
    const bool same = c > 0 && std::ranges::all_of(means, [&](const auto& v) { return v[c] == v[c - 1]; });
    if (same) {  // grey
      for (std::size_t i = 0; i < means.size(); ++i)
        for (auto* of : {&centres_, &scale_, &constant_}) (*of)[i][c] = (*of)[i][c - 1];
      continue;
    }
    Values at = given, scale;
    for (int round = 0; round <= kRounds; ++round) {
      // A patch with light has a mean above 0, because its own centre contributes. A dark patch remains dark.
      const Values reached = mean * at * mean.transpose();
      scale = (given.array() > 0).select(given.array() / reached.array(), 0.);
      if (round < kRounds) at.array() *= scale.array();
    }
    for (std::size_t i = 0; i < means.size(); ++i) {
      const double of_pair = given.data()[i], centre = at.data()[i], to_mean = scale.data()[i];
      const double peak = of_pair > 0 ? centre * to_mean / of_pair : 0,
                   flat = std::clamp((peak - kPeak) / (kHighestPeak - kPeak), 0., 1.);
      centres_[i][c] = float(centre);
      scale_[i][c] = float(to_mean * (1 - flat));
      constant_[i][c] = float(of_pair * flat);
    }
  }
}

Rgb<double> PatchMatrix::eval(double theta_i, double phi_i, double theta_o, double phi_o) const {
  const Patches::Around in = patches_.around(theta_i, phi_i), out = patches_.around(theta_o, phi_o);
  const std::size_t size = patches_.size();
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t o = 0; o < 4; ++o) {
      const double weight = in.weight[i] * out.weight[o];
      const auto& value = centres_[in.patch[i] * size + out.patch[o]];
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * double(value[c]);
    }
  const std::size_t pair = patches_.patch(theta_i, phi_i) * size + patches_.patch(theta_o, phi_o);
  for (std::size_t c = 0; c < 3; ++c) sum[c] = sum[c] * double(scale_[pair][c]) + double(constant_[pair][c]);
  return Rgb<double>(sum[0], sum[1], sum[2]);
}

}  // namespace brdfc::measured
