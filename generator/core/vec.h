// SPDX-License-Identifier: GPL-3.0-or-later
// Vectors and colours over any scalar type.
#pragma once

#include <array>

#include "core/scalar.h"

namespace brdfc::inline core {

/// A direction or vector. Local shading frame: z is the normal, x the tangent.
template <class T> struct Vec3 {
  T x{}, y{}, z{};

  template <class S> static Vec3 from(const Vec3<S>& v) { return {T(v.x), T(v.y), T(v.z)}; }
};

template <class T> Vec3<T> operator+(const Vec3<T>& a, const Vec3<T>& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class T> Vec3<T> operator-(const Vec3<T>& a, const Vec3<T>& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class T> Vec3<T> operator-(const Vec3<T>& a) { return {-a.x, -a.y, -a.z}; }
template <class T> Vec3<T> operator*(const Vec3<T>& a, const T& s) { return {a.x * s, a.y * s, a.z * s}; }
template <class T> Vec3<T> operator*(const T& s, const Vec3<T>& a) { return a * s; }
template <class T> Vec3<T> operator/(const Vec3<T>& a, const T& s) { return {a.x / s, a.y / s, a.z / s}; }
template <class T> T dot(const Vec3<T>& a, const Vec3<T>& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class T> Vec3<T> cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T> T length(const Vec3<T>& a) { return sqrt(dot(a, a)); }
template <class T> Vec3<T> normalize(const Vec3<T>& a) { return a / length(a); }

/// Squared sine of the angle to the normal. It is computed from x and y, because 1 - z^2 loses digits near the normal.
template <class T> T sin2_theta(const Vec3<T>& w) { return w.x * w.x + w.y * w.y; }

/// Rotates the frame by -angle about the normal, so that a lobe turned by +angle is axis-aligned.
template <class T> Vec3<T> rotate_z(const Vec3<T>& w, const T& cos_angle, const T& sin_angle) {
  return {cos_angle * w.x + sin_angle * w.y, cos_angle * w.y - sin_angle * w.x, w.z};
}

template <class Flag, class T> Vec3<T> select(const Flag& first, const Vec3<T>& a, const Vec3<T>& b) {
  return {select(first, a.x, b.x), select(first, a.y, b.y), select(first, a.z, b.z)};
}

/// Unit vector with z = cos_theta (0 < |cos_theta| <= 1) and azimuth phi from the tangent.
inline Vec3<double> direction(double cos_theta, double phi) {
  const double s = std::sqrt((1 - cos_theta) * (1 + cos_theta));
  return {s * std::cos(phi), s * std::sin(phi), cos_theta};
}

/// Linear scene-referred RGB reflectance or radiance.
template <class T> struct Rgb {
  T r{}, g{}, b{};

  Rgb() = default;
  Rgb(const T& r_, const T& g_, const T& b_) : r(r_), g(g_), b(b_) {}
  explicit Rgb(const T& grey) : r(grey), g(grey), b(grey) {}
};

template <Arithmetic T> Rgb<T> operator+(const Rgb<T>& a, const Rgb<T>& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
template <Arithmetic T> Rgb<T> operator-(const Rgb<T>& a, const Rgb<T>& b) { return {a.r - b.r, a.g - b.g, a.b - b.b}; }
template <Arithmetic T> Rgb<T> operator*(const Rgb<T>& a, const Rgb<T>& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
template <Arithmetic T> Rgb<T> operator*(const Rgb<T>& a, const T& s) { return {a.r * s, a.g * s, a.b * s}; }
template <Arithmetic T> Rgb<T> operator*(const T& s, const Rgb<T>& a) { return a * s; }
template <Arithmetic T> Rgb<T> operator/(const Rgb<T>& a, const T& s) { return {a.r / s, a.g / s, a.b / s}; }
template <Arithmetic T> Rgb<T> operator/(const Rgb<T>& a, const Rgb<T>& b) { return {a.r / b.r, a.g / b.g, a.b / b.b}; }
template <Arithmetic T> Rgb<T>& operator+=(Rgb<T>& a, const Rgb<T>& b) { return a = a + b; }
template <Numeric T> Rgb<T> select(bool condition, const Rgb<T>& a, const Rgb<T>& b) { return condition ? a : b; }
template <Arithmetic T> Rgb<T> sqrt(const Rgb<T>& c) { return {sqrt(c.r), sqrt(c.g), sqrt(c.b)}; }
template <Arithmetic T> Rgb<T> exp(const Rgb<T>& c) { return {exp(c.r), exp(c.g), exp(c.b)}; }
template <Arithmetic T> Rgb<T> log(const Rgb<T>& c) { return {log(c.r), log(c.g), log(c.b)}; }
template <Arithmetic T> T max_component(const Rgb<T>& c) { return maximum(c.r, maximum(c.g, c.b)); }

template <Arithmetic T> Rgb<T> magnitude(const Rgb<T>& c) { return {abs(c.r), abs(c.g), abs(c.b)}; }

/// Luminance of linear Rec.709 primaries (ITU-R BT.709). Used only to choose between lobes.
template <Arithmetic T> T luminance(const Rgb<T>& c) { return T(0.2126) * c.r + T(0.7152) * c.g + T(0.0722) * c.b; }
template <Arithmetic T> const Rgb<T>& named(const char*, const Rgb<T>& c) { return c; }

/// The first two axes of an orthonormal frame (u, v, w) that varies smoothly with w, for w.z >= 0.
template <class T> std::array<Vec3<T>, 2> across_axis(const Vec3<T>& w) {
  const T a = T(1) / (T(1) + w.z), b = -w.x * w.y * a;
  return {{{T(1) - w.x * w.x * a, b, -w.x}, {b, T(1) - w.y * w.y * a, -w.y}}};
}
/// s.x u + s.y v + s.z w, with u and v of across_axis().
template <class T> Vec3<T> about_axis(const Vec3<T>& w, const Vec3<T>& s) {
  const auto [u, v] = across_axis(w);
  return u * s.x + v * s.y + w * s.z;
}

}  // namespace brdfc::inline core
