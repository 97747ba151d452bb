// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <bit>
#include <cstdint>

#include "core/vec.h"

namespace brdfc::reference {

/// SplitMix64 (G. Steele, D. Lea, C. Flood, 2014), started at a hash of seed, pixel and sample. Each path has its own
/// numbers, so a picture does not depend on the order or number of threads.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t pixel, std::uint64_t sample) : key_(mix(mix(mix(seed) + pixel) + sample)) {}

  /// The key that determines the numbers.
  std::uint64_t key() const { return key_; }
  /// Number `index` for a key: uniform in [0, 1), a multiple of 2^-52.
  static double at(std::uint64_t key, std::uint64_t index) {
    // The bits become the significand of a number in [1, 2): more instruction sets have vector instructions for that
    // than for a conversion.
    const std::uint64_t significand = mix(key + index * 0x9e3779b97f4a7c15ULL) >> 12;
    return std::bit_cast<double>(0x3ff0000000000000ULL | significand) - 1;
  }
  /// The next number.
  double uniform() { return at(key_, ++last_); }
  Vec3<double> uniform3() {
    const double a = uniform(), b = uniform();
    return {a, b, uniform()};
  }

  /// SplitMix64's finaliser: a bijection.
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ z >> 27) * 0x94d049bb133111ebULL;
    return z ^ z >> 31;
  }

 private:
  std::uint64_t key_, last_ = 0;
};

}  // namespace brdfc::reference
