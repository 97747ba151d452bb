// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/patterns.h"

#include <algorithm>
#include <bit>
#include <stdexcept>

namespace brdfc::reference {
namespace {

/// A number in [0, 1) with 32 bits: adding it to the index of a cell never rounds up to the next cell.
double fraction(std::uint64_t hash) { return double(hash >> 32) * 0x1p-32; }

}  // namespace

const std::vector<std::string>& pattern_names() {
  static const std::vector<std::string> names{"random", "regular", "jittered", "multi_jittered", "hammersley"};
  return names;
}

Pattern pattern_named(const std::string& name) {
  const auto& names = pattern_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) throw std::out_of_range("no sampling pattern " + name);
  return Pattern(found - names.begin());
}

double radical_inverse(std::uint32_t i) {
  double out = 0;
  for (double digit = 0.5; i; i >>= 1, digit /= 2)
    if (i & 1) out += digit;
  return out;
}

std::uint32_t permuted(std::uint32_t i, std::uint32_t n, std::uint64_t key) {
  // A bijection on the integers below the next power of two, repeated until the result is below n. This walks along one
  // of its cycles, which returns to i at the latest, so the loop ends.
  const int bits = std::bit_width(n - 1);
  if (bits == 0) return 0;
  const std::uint64_t mask = (std::uint64_t(1) << bits) - 1;
  const int shift = std::max(bits / 2, 1);
  std::uint64_t x = i;
  do {
    std::uint64_t round = key;
    for (int k = 0; k < 4; ++k) {
      round = Random::mix(round + 0x9e3779b97f4a7c15ULL);
      x = (x + round) & mask;              // each step is invertible: addition,
      x = x * ((round >> 32) | 1) & mask;  // multiplication by an odd number,
      x ^= x >> shift;                     // xor of the high bits into the low ones
    }
  } while (x >= n);
  return std::uint32_t(x);
}

PatternPoints::PatternPoints(Pattern pattern, int count) : pattern_(pattern), count_(std::uint32_t(count)) {
  columns_ = 1;
  for (std::uint32_t c = 1; std::uint64_t(c) * c <= count_; ++c)
    if (count_ % c == 0) columns_ = c;
  rows_ = count_ / columns_;
}

std::array<double, 2> PatternPoints::point(int index, std::uint64_t key) const {
  const auto i = std::uint32_t(index);
  const std::uint32_t column = i % columns_, row = i / columns_;
  const std::uint64_t own = Random::mix(key + i);
  const double a = fraction(own), b = fraction(Random::mix(own));
  switch (pattern_) {
    case Pattern::Regular:
      return {(column + 0.5) / columns_, (row + 0.5) / rows_};
    case Pattern::Jittered:
      return {(column + a) / columns_, (row + b) / rows_};
    case Pattern::MultiJittered: {
      // Each column is divided into `rows` parts, and the x of each of its cells lies in a different part; likewise y.
      const std::uint32_t part_x = permuted(row, rows_, Random::mix(key ^ 0x2545f4914f6cdd1dULL) + column);
      const std::uint32_t part_y = permuted(column, columns_, Random::mix(key ^ 0x9fb21c651e98df25ULL) + row);
      return {(column * rows_ + part_x + a) / count_, (row * columns_ + part_y + b) / count_};
    }
    case Pattern::Hammersley:
      return {double(i) / count_, radical_inverse(i)};
    case Pattern::Random:
      break;
  }
  return {a, b};
}

std::uint64_t PathSampler::pattern_key(std::uint64_t seed, std::uint64_t pixel) {
  return Random::mix(Random::mix(seed ^ 0x6a09e667f3bcc909ULL) + pixel);
}

std::array<double, 2> PathSampler::point(std::uint64_t dimension) const {
  const std::uint64_t key = Random::mix(pattern_key_ + dimension * 0x9e3779b97f4a7c15ULL);
  const auto index = permuted(std::uint32_t(sample_), std::uint32_t(points_.count()), key);
  return points_.point(int(index), Random::mix(key ^ 0xbb67ae8584caa73bULL));
}

}  // namespace brdfc::reference
