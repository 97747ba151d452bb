// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/albedo_text.h"

#include <fmt/format.h>

#include <set>
#include <vector>

#include "forms/choice_switch.h"
#include "print/osl_table.h"
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
      if (used_.count(int(g))) out += print::table_arrays(table_.grids[g], std::to_string(g));
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

  std::string lookup(int index) {
    const Table& g = table_.grids.at(std::size_t(index));
    if (g.axes.size() > 4)
      input_error("{}: the albedo table has {} axes, and OSL look-ups exist for 4", info_.name, g.axes.size());
    if (g.values.size() > print::kMaxArray)
      input_error("{}: the albedo table has {} numbers, and an OSL array may have {}", info_.name, g.values.size(),
                  print::kMaxArray);
    const std::string suffix = std::to_string(index);
    if (!g.axes.empty() && used_.insert(index).second) {
      std::vector<std::string> coordinates;
      for (const TableAxis& a : g.axes) coordinates.push_back(operand(a.name));
      positions_ += print::positions(g, coordinates, suffix);
    }
    return print::look_up(g, suffix);
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
