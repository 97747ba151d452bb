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

/// A coordinate on the axis' scale, as its array of knots is.
std::string scaled(const TableAxis& axis, const std::string& coordinate) {
  switch (axis.scale) {
    case AxisScale::Log:
      return fmt::format("log(max({}, {}))", coordinate, number(axis.values.front()));
    case AxisScale::Log1p:
      return fmt::format("log(1.0 + {})", coordinate);
    default:
      return coordinate;
  }
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

std::string table_arrays(const Table& t, const std::string& suffix) {
  std::string out;
  for (std::size_t a = 0; a < t.axes.size(); ++a) {
    std::vector<double> knots;
    for (const double k : t.axes[a].values)
      knots.push_back(t.axes[a].scale == AxisScale::Log1p ? std::log1p(k) : to_scale(t.axes[a].scale, k));
    out += array(fmt::format("knots_{}_{}", suffix, a), knots);
  }
  if (t.channels == 1) return out + array("table_" + suffix, t.values);
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<double> channel;
    for (std::size_t i = c; i < t.values.size(); i += 3) channel.push_back(t.values[i]);
    out += array(fmt::format("table_{}_{}", "rgb"[c], suffix), channel);
  }
  return out;
}

std::string positions(const Table& t, const std::vector<std::string>& coordinates, const std::string& suffix) {
  std::string out;
  for (std::size_t a = 0; a < t.axes.size(); ++a)
    out += fmt::format("    float {} = brdfc_position(knots_{}_{}, {}, {});\n", position_name(suffix, a), suffix, a,
                       t.axes[a].values.size(), scaled(t.axes[a], coordinates.at(a)));
  return out;
}

std::string look_up(const Table& t, const std::string& suffix) {
  if (t.axes.empty()) return t.channels == 1 ? number(t.values[0]) : color({t.values[0], t.values[1], t.values[2]});
  std::vector<std::string> at;
  for (std::size_t a = 0; a < t.axes.size(); ++a) at.push_back(position_name(suffix, a));
  if (t.channels == 1) return table_call(t, "table_" + suffix, at);
  return fmt::format("color({}, {}, {})", table_call(t, "table_r_" + suffix, at),
                     table_call(t, "table_g_" + suffix, at), table_call(t, "table_b_" + suffix, at));
}

std::string table_call(const Table& t, const std::string& array, const std::vector<std::string>& positions) {
  if (t.axes.empty() || t.axes.size() > 4)
    throw std::logic_error(fmt::format("no look-up in OSL for {} axes", t.axes.size()));
  std::string text = fmt::format("brdfc_table{}({}", t.axes.size(), array);
  for (const TableAxis& a : t.axes) text += fmt::format(", {}", a.values.size());
  for (const std::string& x : positions) text += ", " + x;
  return text + ")";
}

}  // namespace brdfc::print
