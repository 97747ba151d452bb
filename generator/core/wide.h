// SPDX-License-Identifier: GPL-3.0-or-later
// A floating-point number with a 113-bit significand: the reference for rounding errors.
//
// Wraps the compiler's binary128 in the operators and functions that formulas use. It is ten to twenty times as fast as
// Boost's portable type of the same precision, which makes a wide reference affordable for every model.
#pragma once

#include <concepts>
#include <limits>

// glibc's functions, declared here because not every compiler's headers show them.
extern "C" {
__float128 atanf128(__float128) noexcept;
__float128 cbrtf128(__float128) noexcept;
__float128 cosf128(__float128) noexcept;
__float128 expf128(__float128) noexcept;
__float128 expm1f128(__float128) noexcept;
__float128 fabsf128(__float128) noexcept;
__float128 logf128(__float128) noexcept;
__float128 log1pf128(__float128) noexcept;
__float128 sinf128(__float128) noexcept;
__float128 sqrtf128(__float128) noexcept;
__float128 ldexpf128(__float128, int) noexcept;
__float128 powf128(__float128, __float128) noexcept;
}

namespace brdfc::inline core {

class Wide {
 public:
  Wide() = default;
  template <class N>
  requires(std::integral<N> || std::floating_point<N>) Wide(N v)
      : v_(v) {}  // NOLINT: formulas mix literals and scalars
  static Wide of(__float128 v) {
    Wide w;
    w.v_ = v;
    return w;
  }
  template <class N>
  requires(std::integral<N> || std::floating_point<N>) explicit operator N() const { return static_cast<N>(v_); }
  __float128 value() const { return v_; }

  friend Wide operator-(const Wide& a) { return of(-a.v_); }
  friend Wide operator+(const Wide& a, const Wide& b) { return of(a.v_ + b.v_); }
  friend Wide operator-(const Wide& a, const Wide& b) { return of(a.v_ - b.v_); }
  friend Wide operator*(const Wide& a, const Wide& b) { return of(a.v_ * b.v_); }
  friend Wide operator/(const Wide& a, const Wide& b) { return of(a.v_ / b.v_); }
  friend Wide& operator+=(Wide& a, const Wide& b) { return a = a + b; }
  friend Wide& operator-=(Wide& a, const Wide& b) { return a = a - b; }
  friend Wide& operator*=(Wide& a, const Wide& b) { return a = a * b; }
  friend Wide& operator/=(Wide& a, const Wide& b) { return a = a / b; }
  friend bool operator==(const Wide& a, const Wide& b) { return a.v_ == b.v_; }
  friend bool operator!=(const Wide& a, const Wide& b) { return a.v_ != b.v_; }
  friend bool operator<(const Wide& a, const Wide& b) { return a.v_ < b.v_; }
  friend bool operator<=(const Wide& a, const Wide& b) { return a.v_ <= b.v_; }
  friend bool operator>(const Wide& a, const Wide& b) { return a.v_ > b.v_; }
  friend bool operator>=(const Wide& a, const Wide& b) { return a.v_ >= b.v_; }

 private:
  __float128 v_ = 0;
};

inline Wide abs(const Wide& x) { return Wide::of(fabsf128(x.value())); }
inline Wide atan(const Wide& x) { return Wide::of(atanf128(x.value())); }
inline Wide cbrt(const Wide& x) { return Wide::of(cbrtf128(x.value())); }
inline Wide cos(const Wide& x) { return Wide::of(cosf128(x.value())); }
inline Wide exp(const Wide& x) { return Wide::of(expf128(x.value())); }
inline Wide expm1(const Wide& x) { return Wide::of(expm1f128(x.value())); }
inline Wide log(const Wide& x) { return Wide::of(logf128(x.value())); }
inline Wide log1p(const Wide& x) { return Wide::of(log1pf128(x.value())); }
inline Wide pow(const Wide& x, const Wide& y) { return Wide::of(powf128(x.value(), y.value())); }
inline Wide sin(const Wide& x) { return Wide::of(sinf128(x.value())); }
inline Wide sqrt(const Wide& x) { return Wide::of(sqrtf128(x.value())); }
inline bool isfinite(const Wide& x) { return x.value() - x.value() == 0; }

/// Exponent of two of the smallest positive normal number.
inline constexpr int kWideMinExponent = -16382;

}  // namespace brdfc::inline core

template <> class std::numeric_limits<brdfc::Wide> {
 public:
  static constexpr bool is_specialized = true;
  static constexpr int digits = 113;
  static brdfc::Wide epsilon() { return brdfc::Wide(0x1p-112); }
  static brdfc::Wide min() { return brdfc::Wide::of(ldexpf128(1, brdfc::kWideMinExponent)); }
};
