// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/shapes.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/scalar.h"
#include "core/vec.h"

namespace brdfc::reference {

namespace {

std::array<float, 3> to_float(double x, double y, double z) { return {float(x), float(y), float(z)}; }

void add_triangle(Mesh& mesh, std::size_t a, std::size_t b, std::size_t c) {
  mesh.triangles.push_back({std::int32_t(a), std::int32_t(b), std::int32_t(c)});
}

/// Adds two triangles for each cell of a grid of `rows` * `columns` vertices, stored row by row. They are anticlockwise
/// if columns run to the right and rows upwards.
void add_grid(Mesh& mesh, std::size_t rows, std::size_t columns) {
  for (std::size_t j = 0; j + 1 < rows; ++j)
    for (std::size_t i = 0; i + 1 < columns; ++i) {
      const std::size_t a = j * columns + i, b = a + 1, c = b + columns, d = a + columns;
      add_triangle(mesh, a, b, c);
      add_triangle(mesh, a, c, d);
    }
}

/// A number in [0, 1) that is the same on every platform, which std::uniform_real_distribution does not guarantee.
double uniform(std::mt19937& random) { return random() * 0x1p-32; }

using Position = Vec3<double>;

}  // namespace

Mesh make_sphere(double radius, int segments, int rings, bool smooth) {
  Mesh mesh;
  // sin and cos of multiples of a right angle are not exact. Tiny values are set to 0, so that poles and seam close
  // exactly.
  const auto clean = [](double x) { return abs(x) < 1e-15 ? 0.0 : x; };
  for (int j = 0; j <= rings; ++j) {
    const double theta = kPi * j / rings;  // 0 at the lower pole
    const double s = clean(sin(theta)), z = -clean(cos(theta));
    for (int i = 0; i <= segments; ++i) {
      const double phi = 2 * kPi * (i % segments) / segments;
      const double x = s * clean(cos(phi)), y = s * clean(sin(phi));
      mesh.vertices.push_back(to_float(radius * x, radius * y, radius * z));
      if (smooth) mesh.normals.push_back(to_float(x, y, z));
      mesh.uvs.push_back({float(double(i) / segments), float(double(j) / rings)});
    }
  }
  const int row = segments + 1;
  for (int j = 0; j < rings; ++j)
    for (int i = 0; i < segments; ++i) {
      const std::size_t a = std::size_t(j) * row + i, b = a + 1, c = b + row, d = a + row;
      if (j > 0) add_triangle(mesh, a, b, c);  // the first and the last ring have one triangle per segment
      if (j < rings - 1) add_triangle(mesh, a, c, d);
    }
  return mesh;
}

Mesh make_quad(double width, double height) {
  Mesh mesh;
  const double x = width / 2, y = height / 2;
  mesh.vertices = {to_float(-x, -y, 0), to_float(x, -y, 0), to_float(x, y, 0), to_float(-x, y, 0)};
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

Mesh make_disk(double radius, int segments) {
  Mesh mesh;
  mesh.vertices.push_back({0, 0, 0});
  mesh.uvs.push_back({0.5f, 0.5f});
  for (int i = 0; i < segments; ++i) {
    const double c = cos(2 * kPi * i / segments), s = sin(2 * kPi * i / segments);
    mesh.vertices.push_back(to_float(radius * c, radius * s, 0));
    mesh.uvs.push_back({float(0.5 + 0.5 * c), float(0.5 + 0.5 * s)});
  }
  for (int i = 0; i < segments; ++i) add_triangle(mesh, 0, 1 + i, 1 + (i + 1) % segments);
  return mesh;
}

Mesh make_box(const std::array<double, 3>& size) {
  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = -1; side <= 1; side += 2) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const std::size_t first = mesh.vertices.size();
      for (const auto& [s, t] : {std::pair{0, 0}, {1, 0}, {1, 1}, {0, 1}}) {
        std::array<float, 3> p;
        p[axis] = float(side * size[axis] / 2);
        // The lower side is mirrored, so that its corners are anticlockwise seen from outside.
        p[u] = float(side * (s - 0.5) * size[u]);
        p[v] = float((t - 0.5) * size[v]);
        mesh.vertices.push_back(p);
        mesh.uvs.push_back({float(s), float(t)});
      }
      add_triangle(mesh, first, first + 1, first + 2);
      add_triangle(mesh, first, first + 2, first + 3);
    }
  return mesh;
}

Mesh make_cylinder(double radius, double height, int segments, bool smooth) {
  Mesh mesh;
  const auto at = [&](int i) {
    const double phi = 2 * kPi * (i % segments) / segments;
    return std::pair(cos(phi), sin(phi));
  };
  const auto add = [&](const Position& p, const Position& normal, double u, double v) {
    mesh.vertices.push_back(to_float(p.x, p.y, p.z));
    mesh.normals.push_back(to_float(normal.x, normal.y, normal.z));
    mesh.uvs.push_back({float(u), float(v)});
    return mesh.vertices.size() - 1;
  };
  for (int i = 0; i < segments; ++i) {
    // Each segment has its own corners, because flat sides share no normals.
    const auto [c0, s0] = at(i);
    const auto [c1, s1] = at(i + 1);
    const auto [cm, sm] = std::pair(cos(2 * kPi * (i + 0.5) / segments), sin(2 * kPi * (i + 0.5) / segments));
    const Position n0 = smooth ? Position{c0, s0, 0} : Position{cm, sm, 0}, n1 = smooth ? Position{c1, s1, 0} : n0;
    const double u0 = double(i) / segments, u1 = double(i + 1) / segments, top = height / 2;
    const auto a = add({radius * c0, radius * s0, -top}, n0, u0, 0);
    const auto b = add({radius * c1, radius * s1, -top}, n1, u1, 0);
    const auto c = add({radius * c1, radius * s1, top}, n1, u1, 1);
    const auto d = add({radius * c0, radius * s0, top}, n0, u0, 1);
    add_triangle(mesh, a, b, c);
    add_triangle(mesh, a, c, d);
  }
  for (const double side : {-1.0, 1.0}) {
    const Position normal{0, 0, side};
    const auto centre = add({0, 0, side * height / 2}, normal, 0.5, 0.5);
    for (int i = 0; i < segments; ++i) {
      const auto [c, s] = at(i);
      add({radius * c, radius * s, side * height / 2}, normal, 0.5 + 0.5 * c, 0.5 + 0.5 * s);
    }
    for (int i = 0; i < segments; ++i) {
      const auto a = centre + 1 + i, b = centre + 1 + (i + 1) % segments;
      side > 0 ? add_triangle(mesh, centre, a, b) : add_triangle(mesh, centre, b, a);
    }
  }
  return mesh;
}

Mesh make_knot(int p, int q, double tube, int ripples, int segments, int sides) {
  const auto centre = [&](double t) {
    const double r = 1 + 0.4 * cos(q * t);
    return Position{r * cos(p * t), r * sin(p * t), 0.4 * sin(q * t)};
  };
  const auto along = [&](double t) {
    const double r = 1 + 0.4 * cos(q * t), dr = -0.4 * q * sin(q * t);
    return Position{dr * cos(p * t) - p * r * sin(p * t), dr * sin(p * t) + p * r * cos(p * t), 0.4 * q * cos(q * t)};
  };
  const double turn = 2 * kPi;
  const auto surface = [&](double t, double angle) {
    // A frame based on the direction away from the ring's centre. Like the Frenet frame it closes after a whole turn,
    // but it does not flip where the curve is straight.
    const Position tangent = normalize(along(t));
    const Position outwards = centre(t) - Position{cos(p * t), sin(p * t), 0};
    const Position side = normalize(outwards - tangent * dot(outwards, tangent)), up = cross(tangent, side);
    const double radius = tube * (1 + 0.25 * cos(ripples * t));
    return centre(t) + side * (radius * cos(angle)) + up * (radius * sin(angle));
  };
  Mesh mesh;
  for (int j = 0; j <= segments; ++j)
    for (int i = 0; i <= sides; ++i) {
      const double t = turn * (j % segments) / segments, angle = turn * (i % sides) / sides;
      // Central differences: the error due to the step, 1e-10 of the normal, is below the precision of float.
      const double step = 1e-5;
      const Position x = surface(t, angle);
      const Position n = normalize(cross(surface(t, angle + step) - surface(t, angle - step),
                                         surface(t + step, angle) - surface(t - step, angle)));
      const Position out = dot(n, x - centre(t)) < 0 ? n * -1.0 : n;
      mesh.vertices.push_back(to_float(x.x, x.y, x.z));
      mesh.normals.push_back(to_float(out.x, out.y, out.z));
      mesh.uvs.push_back({float(double(i) / sides), float(double(j) / segments)});
    }
  add_grid(mesh, segments + 1, sides + 1);
  return mesh;
}

Mesh make_tiles(int count, double relief, double joint, int resolution, int seed) {
  struct Wave {
    double x, y, phase;
  };
  constexpr int kWaves = 16;
  std::mt19937 random{std::uint32_t(seed)};
  std::vector<std::vector<Wave>> tiles(std::size_t(count) * count);
  for (auto& waves : tiles)
    for (int i = 0; i < kWaves; ++i) {
      const double angle = 2 * kPi * uniform(random), length = 0.5 + uniform(random);  // in tiles
      waves.push_back({2 * kPi / length * cos(angle), 2 * kPi / length * sin(angle), 2 * kPi * uniform(random)});
    }
  // With this amplitude the sum of the waves has a root mean square of 1.
  const double amplitude = sqrt(2.0 / kWaves);
  const auto height = [&](int i, int j, double x, double y) {
    double sum = 0;
    for (const Wave& w : tiles[std::size_t(j) * count + i]) sum += amplitude * cos(w.x * x + w.y * y + w.phase);
    const double edge = std::min({x, y, 1 - x, 1 - y}), t = std::clamp(edge / joint, 0.0, 1.0);
    const double level = t * t * (3 - 2 * t);  // 0 in the joint, where tiles meet, 1 on the tile
    return level * (joint / 4 + relief * sum);
  };
  const int side = count * resolution;
  Mesh mesh;
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i) {
      const int ti = std::min(i / resolution, count - 1), tj = std::min(j / resolution, count - 1);
      const double x = double(i) / resolution - ti, y = double(j) / resolution - tj;
      constexpr double kStep = 1e-6;
      // One-sided differences at a tile's edges, where all tiles have height and slope 0.
      const auto slope = [&](double dx, double dy) {
        const double x0 = std::max(x - dx, 0.0), x1 = std::min(x + dx, 1.0);
        const double y0 = std::max(y - dy, 0.0), y1 = std::min(y + dy, 1.0);
        return (height(ti, tj, x1, y1) - height(ti, tj, x0, y0)) / (x1 - x0 + y1 - y0);
      };
      const Position n = normalize(Position{-slope(kStep, 0), -slope(0, kStep), 1});
      mesh.vertices.push_back(
          to_float(double(i) / resolution - count / 2.0, double(j) / resolution - count / 2.0, height(ti, tj, x, y)));
      mesh.normals.push_back(to_float(n.x, n.y, n.z));
      mesh.uvs.push_back({float(double(i) / side), float(double(j) / side)});
    }
  add_grid(mesh, side + 1, side + 1);
  return mesh;
}

}  // namespace brdfc::reference
