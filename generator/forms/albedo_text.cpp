// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/albedo_text.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <vector>

#include "forms/choice_switch.h"
#include "forms/shader.h"
#include "print/osl_text.h"

namespace brdfc::forms {
namespace {

using print::number;

class AlbedoText {
 public:
  AlbedoText(const ModelInfo& info, const measure::AlbedoTable& table, const ParamValues& fixed)
      : info_(info), table_(table), fixed_(fixed) {}

  std::string print() {
    ChoiceSwitch by_choice(info_, fixed_);
    const std::vector<Choices> combinations = choice_combinations(info_);
    for (std::size_t i = 0; i < combinations.size(); ++i)
      if (admits(info_, combinations[i], fixed_)) by_choice.add(combinations[i], terms(table_.terms.at(i)));
    const std::string body = by_choice.print(4);
    std::string out;
    for (std::size_t g = 0; g < table_.grids.size(); ++g)
      if (used_.count(int(g))) out += arrays(g);
    return out + positions_ + body;
  }

 private:
  std::string terms(const std::vector<measure::AlbedoTerm>& list) {
    std::string out = "    Albedo = 0.0;\n";
    for (const measure::AlbedoTerm& t : list) {
      std::string product = lookup(t.grid);
      for (const std::string& c : t.colors) product = operand(c) + " * " + product;
      out += fmt::format("    Albedo += {};\n", product);
    }
    return out;
  }

  /// A parameter's name, or its value where it is fixed.
  std::string operand(const std::string& name) const {
    const auto it = fixed_.find(name);
    if (it == fixed_.end()) return name == "cos_theta_o" ? "wo_z" : name;
    if (const auto* c = std::get_if<std::array<double, 3>>(&it->second)) return print::color(*c);
    return number(std::get<double>(it->second));
  }

  std::string scaled(const measure::TableAxis& axis) const {
    const std::string x = operand(axis.name);
    switch (axis.scale) {
      case AxisScale::Log:
        return fmt::format("log(max({}, {}))", x, number(axis.values.front()));
      case AxisScale::Log1p:
        return fmt::format("log(1.0 + {})", x);
      default:
        return x;
    }
  }

  std::string lookup(int index) {
    const measure::AlbedoGrid& g = table_.grids.at(std::size_t(index));
    if (g.axes.empty()) {
      if (g.channels == 1) return number(g.values[0]);
      return print::color({g.values[0], g.values[1], g.values[2]});
    }
    if (g.axes.size() > 4)
      input_error("{}: the albedo table has {} axes, and OSL look-ups exist for 4", info_.name, g.axes.size());
    if (g.values.size() > kMaxArray)
      input_error("{}: the albedo table has {} numbers, and an OSL array may have {}", info_.name, g.values.size(),
                  kMaxArray);
    if (used_.insert(index).second)
      for (std::size_t a = 0; a < g.axes.size(); ++a)
        positions_ += fmt::format("    float position_{}_{} = brdfc_position(knots_{}_{}, {}, {});\n", index, a, index,
                                  a, g.axes[a].values.size(), scaled(g.axes[a]));
    if (g.channels == 1) return call(g, index, "");
    return fmt::format("color({}, {}, {})", call(g, index, "_r"), call(g, index, "_g"), call(g, index, "_b"));
  }

  static std::string call(const measure::AlbedoGrid& g, int index, const std::string& channel) {
    std::string text = fmt::format("brdfc_table{}(table{}_{}", g.axes.size(), channel, index);
    for (const measure::TableAxis& a : g.axes) text += fmt::format(", {}", a.values.size());
    for (std::size_t a = 0; a < g.axes.size(); ++a) text += fmt::format(", position_{}_{}", index, a);
    return text + ")";
  }

  std::string arrays(std::size_t index) const {
    const measure::AlbedoGrid& g = table_.grids[index];
    std::string out;
    for (std::size_t a = 0; a < g.axes.size(); ++a) {
      std::vector<double> knots = g.axes[a].values;
      for (double& k : knots)
        k = g.axes[a].scale == AxisScale::Log ? std::log(k) : g.axes[a].scale == AxisScale::Log1p ? std::log1p(k) : k;
      out += print::array(fmt::format("knots_{}_{}", index, a), knots);
    }
    if (g.channels == 1) return out + print::array(fmt::format("table_{}", index), {g.values.begin(), g.values.end()});
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<double> channel;
      for (std::size_t i = c; i < g.values.size(); i += 3) channel.push_back(g.values[i]);
      out += print::array(fmt::format("table_{}_{}", "rgb"[c], index), channel);
    }
    return out;
  }

  const ModelInfo& info_;
  const measure::AlbedoTable& table_;
  const ParamValues& fixed_;
  std::set<int> used_;
  std::string positions_;
};

}  // namespace

std::string albedo_text(const ModelInfo& info, const measure::AlbedoTable& table, const ParamValues& fixed) {
  return AlbedoText(info, table, fixed).print();
}

}  // namespace brdfc::forms
