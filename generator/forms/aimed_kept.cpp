// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/aimed_kept.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace brdfc::forms {
namespace {

using print::assign;
using print::call;
using print::choice;
using print::declare;
using print::element;
using print::Statement;
using print::Statements;
using print::Value;

/// The numbers of a lamp and its lobe that later iterations read, kept in two arrays of matrices. Wherever they are
/// read or assigned they have variables of their own. OSL's compiler checks the index at each mention of an array's
/// element and gives the check code of its own. Formulas that read elements doubled the time that a shader takes to
/// compile, and an array for each number cost another tenth.
struct Kept {
  const char *type, *of, *name;
};
constexpr Kept kKept[] = {
    {"vector", "lamp", "centre"}, {"vector", "lamp", "across"},     {"vector", "lamp", "along"},
    {"float", "lamp", "disk"},    {"float", "lamp", "solid_angle"}, {"vector", "lobe", "towards"},
    {"vector", "lobe", "half"},   {"color", "lobe", "value"},       {"float", "lobe", "exponent"},
    {"float", "lobe", "radius"},  {"float", "lobe", "end"},         {"float", "lobe", "extent"},
    {"float", "lobe", "rise"},
};
std::size_t size_of(const Kept& kept) { return kept.type == std::string_view("float") ? 1 : 3; }
/// A variable's value, read from a matrix.
Value in_matrix(const std::string& matrix, const Kept& kept) {
  std::size_t at = 0;
  for (const Kept* k = kKept; k != &kept; ++k)
    if (k->of == std::string_view(kept.of)) at += size_of(*k);
  std::vector<Value> numbers;
  for (std::size_t i = at; i < at + size_of(kept); ++i)
    numbers.push_back(element(element(matrix, int(i / 4)), int(i % 4)));
  return numbers.size() == 1 ? numbers[0] : call(kept.type, numbers);
}

}  // namespace

std::string kept_array(std::string_view of) { return fmt::format("kept_{}", of); }

Statement keep(std::string_view of) {
  std::vector<Value> numbers;
  for (const Kept& kept : kKept) {
    if (of != kept.of) continue;
    const std::string name = fmt::format("{}_{}", kept.of, kept.name);
    for (std::size_t i = 0; i < size_of(kept); ++i)
      numbers.push_back(size_of(kept) == 1 ? Value(name) : element(name, int(i)));
  }
  numbers.resize(16, Value(0.0));
  return assign(element(kept_array(of), "lobes"), call("matrix", numbers));
}

Statements load(const std::string& of, const char* index, const std::vector<std::string_view>& names) {
  Statements out;
  std::set<std::string> read;
  for (const std::string_view name : names) {
    const Kept& kept = *std::ranges::find(kKept, name, &Kept::name);
    const std::string matrix = fmt::format("{}_{}", of, kept.of);
    if (read.insert(matrix).second) out.push_back(declare("matrix", matrix, element(kept_array(kept.of), index)));
    Value value = in_matrix(matrix, kept);
    // If no lamp has corners, OSL leaves out what they need.
    if (name == "disk") value = choice("any_corner", value, 1.0);
    out.push_back(declare(kept.type, fmt::format("{}_{}", of, name), value));
  }
  return out;
}

}  // namespace brdfc::forms
