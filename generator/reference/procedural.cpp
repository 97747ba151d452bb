// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/procedural.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace brdfc::reference {

Vec3<double> equirectangular_to_direction(double u, double v) {
  const double phi = kPi * (1 - 2 * u), latitude = kPi * (v - 0.5);
  return {cos(latitude) * cos(phi), cos(latitude) * sin(phi), sin(latitude)};
}

namespace {

using Color = Rgb<double>;
using Direction = Vec3<double>;

Color mix(const Color& a, const Color& b, double t) { return a * (1 - t) + b * t; }

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// A sky: pale horizon, deep blue zenith, dark ground with a bright square pattern, a small sun, and a row of luminous
/// panels in three colours. Its edges and points show the width of a lobe.
Color sky(const Direction& d) {
  const double azimuth = atan2(d.y, d.x), elevation = asin(std::clamp(d.z, -1.0, 1.0));
  static const Direction sun = normalize(Direction{0.62, -0.48, 0.62});
  static const double cos_of_sun = cos(0.04);
  if (dot(d, sun) > cos_of_sun) return {220, 200, 160};

  const double panel = azimuth / (2 * kPi) * 12;
  const double across = std::abs(panel - std::round(panel));
  if (across < 0.12 && elevation > 0.12 && elevation < 0.5) {
    const int which = (int(std::round(panel)) + 12) % 3;
    return which == 0 ? Color(9, 7.5, 6) : which == 1 ? Color(2.5, 5, 9) : Color(7, 3, 1.2);
  }
  if (d.z < 0) {
    const double x = d.x / -d.z, y = d.y / -d.z;  // the ground is one unit below the camera
    const bool light = (int(std::floor(x)) + int(std::floor(y))) % 2 == 0;
    const Color ground = light ? Color(0.32, 0.28, 0.22) : Color(0.08, 0.07, 0.06);
    return mix(Color(0.2, 0.18, 0.15), ground, smooth_step(0, 0.25, -d.z));
  }
  const double glow = std::pow(std::max(dot(d, sun), 0.0), 24);
  return mix(Color(0.85, 0.88, 0.92), Color(0.12, 0.26, 0.62), smooth_step(0, 0.8, elevation)) +
         Color(1.2, 0.9, 0.5) * glow;
}

bool inside(double x, double from, double to) { return x >= from && x <= to; }

/// A room seen from its centre: two ceiling lamps, a window with crossbars, a door, and a tiled floor.
Color interior(const Direction& d) {
  const double half_x = 4, half_y = 3, up = 1.6, down = 1.2;
  const double tx = half_x / std::max(std::abs(d.x), 1e-12), ty = half_y / std::max(std::abs(d.y), 1e-12);
  const double tz = (d.z > 0 ? up : down) / std::max(std::abs(d.z), 1e-12);
  const double t = std::min({tx, ty, tz});
  const Direction p = d * t;
  if (t == tz && d.z > 0) {
    const bool lamp = inside(std::abs(p.y), 0.15, 0.45) && inside(std::abs(p.x), 0.6, 2.4);
    return lamp ? Color(24, 22, 18) : Color(0.55, 0.54, 0.52);
  }
  if (t == tz) {
    const bool tile = (int(std::floor(2 * p.x)) + int(std::floor(2 * p.y))) % 2 == 0;
    return tile ? Color(0.34, 0.24, 0.16) : Color(0.13, 0.09, 0.06);
  }
  if (t == tx && d.x > 0) {
    if (inside(p.y, -1.5, 1.5) && inside(p.z, -0.4, 1.1)) {
      const bool bar =
          std::abs(p.y) < 0.06 || std::abs(p.z - 0.35) < 0.06 || !inside(p.y, -1.42, 1.42) || !inside(p.z, -0.32, 1.02);
      return bar ? Color(0.2, 0.2, 0.2) : mix(Color(14, 15, 17), Color(6, 9, 16), smooth_step(-0.4, 1.1, p.z));
    }
    return {0.42, 0.4, 0.36};
  }
  if (t == tx) {
    const bool picture = inside(p.y, -0.8, 0.8) && inside(p.z, -0.2, 0.8);
    return picture ? (p.y * (p.z - 0.3) > 0 ? Color(0.75, 0.1, 0.08) : Color(0.1, 0.15, 0.6)) : Color(0.38, 0.4, 0.42);
  }
  const bool door = d.y > 0 && inside(p.x, -1.9, -1.0) && p.z < 0.85;
  if (door) return {0.25, 0.1, 0.04};
  const bool strip = d.y < 0 && inside(p.z, 0.5, 0.56) && inside(p.x, -2.5, 2.5);
  if (strip) return {4, 12, 6};
  return {0.3, 0.31, 0.29};
}

/// Cells of 15 degrees, half of them bright: a structured environment for tests of samplers.
Color checker(const Direction& d) {
  double u, v;
  direction_to_equirectangular(d, u, v);
  return (int(std::floor(24 * u)) + int(std::floor(12 * v))) % 2 == 0 ? Color(1, 1, 1) : Color(0.05, 0.05, 0.05);
}

using Radiance = Color (*)(const Direction&);

Radiance radiance_named(const std::string& name) {
  if (name == "sky") return sky;
  if (name == "interior") return interior;
  if (name == "checker") return checker;
  throw std::logic_error("unknown procedural environment " + name);
}

}  // namespace

Image procedural_environment(const std::string& name, int width) {
  const Radiance radiance = radiance_named(name);
  Image image(width, width / 2);
  constexpr int n = 4;
  // All samples of a column have one azimuth, those of a row one latitude: their sines and cosines would take half the
  // time.
  std::vector<Direction> azimuths, latitudes;
  for (int i = 0; i < n * image.width; ++i)
    azimuths.push_back(equirectangular_to_direction((i / n + (i % n + 0.5) / n) / image.width, 0.5));
  for (int j = 0; j < n * image.height; ++j)
    latitudes.push_back(equirectangular_to_direction(0.5, 1 - (j / n + (j % n + 0.5) / n) / image.height));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      Rgb<double> sum(0);
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const Direction &azimuth = azimuths[n * x + i], &latitude = latitudes[n * y + j];
          sum += radiance({latitude.x * azimuth.x, latitude.x * azimuth.y, latitude.z});
        }
      sum = sum / double(n * n);
      float* p = image.pixel(x, y);
      p[0] = float(sum.r), p[1] = float(sum.g), p[2] = float(sum.b);
    }
  return image;
}

Image checker_texture(const Rgb<double>& a, const Rgb<double>& b, int cells) {
  constexpr int n = 16;
  Image image(cells * n, cells * n);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const Rgb<double>& c = (x / n + y / n) % 2 == 0 ? a : b;
      float* p = image.pixel(x, y);
      p[0] = float(c.r), p[1] = float(c.g), p[2] = float(c.b);
    }
  return image;
}

}  // namespace brdfc::reference
