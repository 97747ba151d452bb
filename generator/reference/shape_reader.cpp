// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/shape_reader.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "reference/shapes.h"

namespace brdfc::reference {
namespace {

double number_or(const JsonView& j, const char* key, double otherwise, double min = kSmall, double max = kFar) {
  const auto v = j.find(key);
  return v ? v->number(min, max) : otherwise;
}
int integer_or(const JsonView& j, const char* key, int otherwise, int min, int max) {
  const auto v = j.find(key);
  return v ? v->integer(min, max) : otherwise;
}
template <std::size_t N> std::array<double, N> numbers_or(const JsonView& j, const char* key,
                                                          const std::array<double, N>& otherwise, double min = kSmall,
                                                          double max = kFar) {
  const auto v = j.find(key);
  return v ? v->numbers<N>(min, max) : otherwise;
}
bool boolean_or(const JsonView& j, const char* key, bool otherwise) {
  const auto v = j.find(key);
  return v ? v->boolean() : otherwise;
}

Mesh read_sphere_of_radius(const JsonView& j, double radius) {
  j.only({"type", "radius", "segments", "rings", "smooth"});
  const int segments = integer_or(j, "segments", 256, 3, 8192);
  return make_sphere(radius, segments, integer_or(j, "rings", std::max(2, segments / 2), 2, 4096),
                     boolean_or(j, "smooth", true));
}

Mesh read_sphere(const JsonView& j) { return read_sphere_of_radius(j, read_radius(j)); }

Mesh read_quad(const JsonView& j) {
  j.only({"type", "size"});
  const auto size = numbers_or<2>(j, "size", {1, 1});
  return make_quad(size[0], size[1]);
}

Mesh read_disk(const JsonView& j) {
  j.only({"type", "radius", "segments"});
  return make_disk(number_or(j, "radius", 1), integer_or(j, "segments", 128, 3, 8192));
}

Mesh read_box(const JsonView& j) {
  j.only({"type", "size"});
  return make_box(numbers_or<3>(j, "size", {1, 1, 1}));
}

Mesh read_cylinder(const JsonView& j) {
  j.only({"type", "radius", "height", "segments", "smooth"});
  return make_cylinder(number_or(j, "radius", 1), number_or(j, "height", 2), integer_or(j, "segments", 256, 3, 8192),
                       boolean_or(j, "smooth", true));
}

Mesh read_knot(const JsonView& j) {
  j.only({"type", "turns", "tube", "ripples", "segments", "sides"});
  const auto turns = numbers_or<2>(j, "turns", {2, 3}, 1, 64);
  if (turns[0] != std::floor(turns[0]) || turns[1] != std::floor(turns[1]) ||
      std::gcd(int(turns[0]), int(turns[1])) != 1)
    j.at("turns").fail("two whole numbers without a common divisor");
  return make_knot(int(turns[0]), int(turns[1]), number_or(j, "tube", 0.2, kSmall, 0.4),
                   integer_or(j, "ripples", 48, 0, 512), integer_or(j, "segments", 4096, 3, 16384),
                   integer_or(j, "sides", 64, 3, 1024));
}

Mesh read_tiles(const JsonView& j) {
  j.only({"type", "count", "relief", "joint", "resolution", "seed"});
  return make_tiles(integer_or(j, "count", 6, 1, 64), number_or(j, "relief", 0.002, 0, 0.1),
                    number_or(j, "joint", 0.02, 0.001, 0.5), integer_or(j, "resolution", 96, 2, 512),
                    integer_or(j, "seed", 0, 0, 2147483647));
}

struct Reader {
  const char* type;
  Mesh (*read)(const JsonView&);
};
constexpr Reader kReaders[] = {{"sphere", read_sphere}, {"quad", read_quad},         {"disk", read_disk},
                               {"box", read_box},       {"cylinder", read_cylinder}, {"knot", read_knot},
                               {"tiles", read_tiles}};

}  // namespace

std::vector<std::string> shape_types() {
  std::vector<std::string> types;
  for (const Reader& reader : kReaders) types.emplace_back(reader.type);
  return types;
}

Mesh read_shape_of_numbers(const JsonView& j, const std::string& type) {
  return std::find_if(std::begin(kReaders), std::end(kReaders), [&](const Reader& r) { return r.type == type; })
      ->read(j);
}

double read_radius(const JsonView& j) { return number_or(j, "radius", 1); }

Mesh read_unit_sphere(const JsonView& j) { return read_sphere_of_radius(j, 1); }

}  // namespace brdfc::reference
