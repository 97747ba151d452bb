// SPDX-License-Identifier: GPL-3.0-or-later
// Eight numbers at once: a scalar type in which every operation is a loop that the compiler turns into one vector
// instruction.
//
// A formula over Pack gives the same values as over double, except for the last digits of exp(), sin() and the like,
// which come from glibc's vector library if there is one (4 units in the last place). The value of a lane depends on
// that lane alone. Comparisons return a Mask, which does not convert to bool: formulas are limited to the operations
// that Expr has.
//
// Functions that compute with Pack must be BRDFC_VECTORISED, or be in a source that is compiled for each instruction
// set (core/vectorised.h).
#pragma once

#include <concepts>
#include <cstddef>

#include "core/scalar.h"
#include "core/vec.h"
#include "core/vectorised.h"

namespace brdfc::inline core {

inline constexpr std::size_t kLanes = 8;

inline namespace BRDFC_INSTRUCTION_SET {

#define BRDFC_LANES BRDFC_INDEPENDENT for (std::size_t k = 0; k < kLanes; ++k)

/// One truth value for each lane.
class Mask {
 public:
  Mask() = default;
  explicit Mask(bool all) { BRDFC_LANES lanes_[k] = all ? -1 : 0; }
  bool operator[](std::size_t k) const { return lanes_[k]; }
  void set(std::size_t k, bool holds) { lanes_[k] = holds ? -1 : 0; }
  bool all() const {
    long long both = -1;
    BRDFC_LANES both &= lanes_[k];
    return both;
  }
  operator bool() const = delete;

  friend Mask operator&&(const Mask& a, const Mask& b) {
    Mask out;
    BRDFC_LANES out.lanes_[k] = a.lanes_[k] & b.lanes_[k];
    return out;
  }
  friend Mask operator||(const Mask& a, const Mask& b) {
    Mask out;
    BRDFC_LANES out.lanes_[k] = a.lanes_[k] | b.lanes_[k];
    return out;
  }
  friend Mask operator!(const Mask& a) {
    Mask out;
    BRDFC_LANES out.lanes_[k] = ~a.lanes_[k];
    return out;
  }

 private:
  alignas(sizeof(long long) * kLanes) long long lanes_[kLanes]{};  // 0 or -1, as wide as the numbers that it selects
};

class Pack {
 public:
  Pack() = default;
  template <class N>
  requires(std::integral<N> || std::floating_point<N>) Pack(N v) {  // NOLINT: formulas mix literals and scalars
    BRDFC_LANES lanes_[k] = double(v);
  }
  /// Loads kLanes consecutive numbers of an array.
  static Pack from(const double* numbers) {
    Pack out;
    BRDFC_LANES out.lanes_[k] = numbers[k];
    return out;
  }
  double operator[](std::size_t k) const { return lanes_[k]; }
  double& operator[](std::size_t k) { return lanes_[k]; }

 private:
  alignas(sizeof(double) * kLanes) double lanes_[kLanes]{};
};

/// Applies f to each lane.
template <class F> Pack lane_by_lane(const Pack& a, const F& f) {
  Pack out;
  BRDFC_LANES out[k] = f(a[k]);
  return out;
}
template <class F> Pack lane_by_lane(const Pack& a, const Pack& b, const F& f) {
  Pack out;
  BRDFC_LANES out[k] = f(a[k], b[k]);
  return out;
}
template <class F> Mask compare(const Pack& a, const Pack& b, const F& f) {
  Mask out;
  BRDFC_LANES out.set(k, f(a[k], b[k]));
  return out;
}

inline Pack operator-(const Pack& a) {
  return lane_by_lane(a, [](double x) { return -x; });
}
inline Pack operator+(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return x + y; });
}
inline Pack operator-(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return x - y; });
}
inline Pack operator*(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return x * y; });
}
inline Pack operator/(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return x / y; });
}
inline Mask operator<(const Pack& a, const Pack& b) {
  return compare(a, b, [](double x, double y) { return x < y; });
}
inline Mask operator<=(const Pack& a, const Pack& b) {
  return compare(a, b, [](double x, double y) { return x <= y; });
}
inline Mask operator>(const Pack& a, const Pack& b) { return b < a; }
inline Mask operator>=(const Pack& a, const Pack& b) { return b <= a; }

inline Pack select(const Mask& condition, const Pack& a, const Pack& b) {
  Pack out;
  BRDFC_LANES out[k] = condition[k] ? a[k] : b[k];
  return out;
}
inline Rgb<Pack> select(const Mask& condition, const Rgb<Pack>& a, const Rgb<Pack>& b) {
  return {select(condition, a.r, b.r), select(condition, a.g, b.g), select(condition, a.b, b.b)};
}
inline Pack minimum(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return y < x ? y : x; });
}
inline Pack maximum(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return x < y ? y : x; });
}
inline Pack abs(const Pack& a) {
  return lane_by_lane(a, [](double x) { return std::abs(x); });
}
inline Pack sqrt(const Pack& a) {
  return lane_by_lane(a, [](double x) { return std::sqrt(x); });
}

/// The vector or colour in one lane.
inline Vec3<double> lane(const Vec3<Pack>& v, std::size_t k) { return {v.x[k], v.y[k], v.z[k]}; }
inline Rgb<double> lane(const Rgb<Pack>& c, std::size_t k) { return {c.r[k], c.g[k], c.b[k]}; }

#define BRDFC_FUNCTION(name)                                              \
  inline Pack name(const Pack& a) {                                       \
    return lane_by_lane(a, [](double x) { return vectorised::name(x); }); \
  }
BRDFC_FORMULA_FUNCTIONS(BRDFC_FUNCTION)
#undef BRDFC_FUNCTION
inline Pack pow(const Pack& a, const Pack& b) {
  return lane_by_lane(a, b, [](double x, double y) { return vectorised::pow(x, y); });
}
#undef BRDFC_LANES

}  // namespace BRDFC_INSTRUCTION_SET

}  // namespace brdfc::inline core
