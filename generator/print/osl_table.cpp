// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_table.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "print/osl_text.h"

namespace brdfc::print {
namespace {

std::string position_name(const std::string& suffix, std::size_t axis) {
  return fmt::format("position_{}_{}", suffix, axis);
}

/// The coordinate on the scale of the axis, as in its array of knots.
Value scaled(const TableAxis& axis, const Value& coordinate) {
  switch (axis.scale) {
    case AxisScale::Log:
      return call("log", {call("max", {coordinate, axis.values.front()})});
    case AxisScale::Log1p:
      return call("log", {Value(1.0) + coordinate});
    default:
      return coordinate;
  }
}

/// A look-up in one channel.
Value table_call(const Table& t, const std::string& array, const std::string& suffix) {
  std::vector<Value> arguments = {array};
  for (const TableAxis& a : t.axes) arguments.push_back(int(a.values.size()));
  for (std::size_t a = 0; a < t.axes.size(); ++a) arguments.push_back(position_name(suffix, a));
  return call(table_function(t), arguments);
}

}  // namespace

std::string compact_array(const std::string& name, const std::vector<double>& values, int indent) {
  std::string out = fmt::format("{:{}}float {}[{}] = {{", "", indent, name, values.size());
  for (std::size_t k = 0; k < values.size(); ++k) {
    std::string value = number(values[k]);
    if (value.starts_with("0.") && value != "0.0") value.erase(0, 1);
    out += (k == 0 ? "" : k % 16 == 0 ? ",\n" : ",") + value;
  }
  return out + "};\n";
}

Statements table_arrays(const Table& t, const std::string& suffix) {
  Statements out;
  const auto add = [&](std::string name, std::vector<double> values) {
    out.push_back(Array{std::move(name), std::move(values), Array::Layout::Aligned});
  };
  for (std::size_t a = 0; a < t.axes.size(); ++a) {
    std::vector<double> knots;
    for (const double k : t.axes[a].values)
      knots.push_back(t.axes[a].scale == AxisScale::Log1p ? std::log1p(k) : to_scale(t.axes[a].scale, k));
    add(fmt::format("knots_{}_{}", suffix, a), knots);
  }
  if (t.channels == 1) {
    add("table_" + suffix, t.values);
    return out;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> channel;
    for (std::size_t i = c; i < t.values.size(); i += 3) channel.push_back(t.values[i]);
    add(fmt::format("table_{}_{}", "rgb"[c], suffix), channel);
  }
  return out;
}

Statements positions(const Table& t, const std::vector<Value>& coordinates, const std::string& suffix) {
  Statements out;
  for (std::size_t a = 0; a < t.axes.size(); ++a)
    out.push_back(declare("float", position_name(suffix, a),
                          call("brdfc_position", {fmt::format("knots_{}_{}", suffix, a), int(t.axes[a].values.size()),
                                                  scaled(t.axes[a], coordinates.at(a))})));
  return out;
}

Value look_up(const Table& t, const std::string& suffix) {
  if (t.axes.empty())
    return t.channels == 1 ? Value(t.values[0]) : call("color", {t.values[0], t.values[1], t.values[2]});
  const auto of = [&](const char* name) { return table_call(t, name + suffix, suffix); };
  return t.channels == 1 ? of("table_") : call("color", {of("table_r_"), of("table_g_"), of("table_b_")});
}

std::string table_function(const Table& t) {
  if (t.axes.empty() || t.axes.size() > 4)
    throw std::logic_error(fmt::format("no look-up in OSL for {} axes", t.axes.size()));
  return fmt::format("brdfc_table{}", t.axes.size());
}

}  // namespace brdfc::print
