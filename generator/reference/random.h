// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>

#include "core/vec.h"

namespace brdfc::reference {

/// xoshiro256++ (D. Blackman, S. Vigna, 2019), started by SplitMix64 from a hash of seed, pixel and sample: a stream
/// of its own for each path, so that a picture does not depend on the order or number of threads.
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t pixel, std::uint64_t sample) {
    std::uint64_t key = mix(mix(mix(seed) + pixel) + sample);
    for (std::uint64_t& word : state_) word = mix(key += 0x9e3779b97f4a7c15ULL);
  }

  /// Uniform in [0, 1), a multiple of 2^-53.
  double uniform() { return double(next() >> 11) * 0x1p-53; }
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
  static std::uint64_t rotate(std::uint64_t x, int k) { return x << k | x >> (64 - k); }

  std::uint64_t next() {
    const std::uint64_t result = rotate(state_[0] + state_[3], 23) + state_[0];
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = rotate(state_[3], 45);
    return result;
  }

  std::uint64_t state_[4];
};

}  // namespace brdfc::reference
