// SPDX-License-Identifier: GPL-3.0-or-later
// Structures of arrays, for loops over paths that compilers turn into vector instructions (core/vectorised.h).
#pragma once

#include <array>
#include <cstddef>

#include "core/pack.h"

namespace brdfc::reference {

/// Number of lanes of a block. The first ones are in use. Others may contain anything: they are computed with, but
/// their results are not read.
inline constexpr std::size_t kBlock = 64;

template <class T> using Lanes = std::array<T, kBlock>;
using Numbers = Lanes<double>;

/// Vectors whose components are stored as T.
template <class T> struct VectorsOf {
  Lanes<T> x, y, z;
  Vec3<double> operator[](std::size_t k) const { return {x[k], y[k], z[k]}; }
  template <class A> void set(std::size_t k, const A& v) { x[k] = T(v[0]), y[k] = T(v[1]), z[k] = T(v[2]); }
  void set(std::size_t k, const Vec3<double>& v) { x[k] = T(v.x), y[k] = T(v.y), z[k] = T(v.z); }
  /// kLanes vectors, beginning with lane `first`.
  Vec3<Pack> pack(std::size_t first) const {
    return {Pack::from(&x[first]), Pack::from(&y[first]), Pack::from(&z[first])};
  }
};
using Vectors = VectorsOf<double>;

struct Colors {
  Numbers r, g, b;
  Rgb<double> operator[](std::size_t k) const { return {r[k], g[k], b[k]}; }
  void set(std::size_t k, const Rgb<double>& c) { r[k] = c.r, g[k] = c.g, b[k] = c.b; }
};

/// Rays of a block; directions are unit vectors.
struct Rays {
  Vectors origin, direction;
};

/// `count`, rounded up to whole vectors.
inline std::size_t lanes_for(std::size_t count) { return (count + kLanes - 1) / kLanes * kLanes; }

/// Calls body(k) for the lanes in [begin, end), which must not depend on each other.
template <class Body> void for_lanes(std::size_t begin, std::size_t end, const Body& body) {
  BRDFC_INDEPENDENT
  for (std::size_t k = begin; k < end; ++k) body(k);
}
/// Calls body(k) for whole vectors that contain the first `count` lanes.
template <class Body> void for_lanes(std::size_t count, const Body& body) { for_lanes(0, lanes_for(count), body); }

}  // namespace brdfc::reference
