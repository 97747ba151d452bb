// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/albedo_output.h"

#include <fmt/format.h>

#include <set>
#include <vector>

#include "forms/choice_switch.h"
#include "print/osl_table.h"
#include "print/statement.h"

namespace brdfc::forms {
namespace {

using print::append;
using print::Statements;
using print::Value;

class AlbedoOutput {
 public:
  AlbedoOutput(const ModelInfo& info, const measure::AlbedoTable& table, const ParamValues& fixed)
      : info_(info), table_(table), fixed_(fixed) {}

  Statements statements() {
    ChoiceSwitch by_choice(info_, fixed_);
    const std::vector<Choices> combinations = choice_combinations(info_);
    for (std::size_t i = 0; i < combinations.size(); ++i)
      if (admits(info_, combinations[i], fixed_)) by_choice.add(combinations[i], terms(table_.terms.at(i)));
    Statements out;
    for (std::size_t g = 0; g < table_.grids.size(); ++g)
      if (used_.count(int(g))) append(out, print::table_arrays(table_.grids[g], std::to_string(g)));
    append(out, std::move(positions_));
    append(out, by_choice.statements());
    return out;
  }

 private:
  Statements terms(const std::vector<measure::AlbedoTerm>& list) {
    Statements out = {print::assign("Albedo", 0.0)};
    for (const measure::AlbedoTerm& t : list) {
      std::vector<Value> factors = {lookup(t.grid)};
      for (const std::string& c : t.colors) factors.insert(factors.begin(), operand(c));
      Value product = factors[0];
      for (std::size_t i = 1; i < factors.size(); ++i) product = product * factors[i];
      out.push_back(print::Assign{"Albedo", product, "+="});
    }
    return out;
  }

  /// The parameter's name, or its value if it is fixed.
  Value operand(const std::string& name) const {
    const auto it = fixed_.find(name);
    if (it == fixed_.end()) return Value(name == "cos_theta_o" ? "wo_z" : name);
    if (const auto* c = std::get_if<std::array<double, 3>>(&it->second))
      return print::call("color", {(*c)[0], (*c)[1], (*c)[2]});
    return std::get<double>(it->second);
  }

  Value lookup(int index) {
    const Table& g = table_.grids.at(std::size_t(index));
    if (g.axes.size() > 4)
      input_error("{}: the albedo table has {} axes, and OSL look-ups exist for 4", info_.name, g.axes.size());
    if (g.values.size() > print::kMaxArray)
      input_error("{}: the albedo table has {} numbers, and an OSL array may have {}", info_.name, g.values.size(),
                  print::kMaxArray);
    const std::string suffix = std::to_string(index);
    if (!g.axes.empty() && used_.insert(index).second) {
      std::vector<Value> coordinates;
      for (const TableAxis& a : g.axes) coordinates.push_back(operand(a.name));
      append(positions_, print::positions(g, coordinates, suffix));
    }
    return print::look_up(g, suffix);
  }

  const ModelInfo& info_;
  const measure::AlbedoTable& table_;
  const ParamValues& fixed_;
  std::set<int> used_;
  Statements positions_;
};

}  // namespace

print::Statements albedo_output(const ModelInfo& info, const measure::AlbedoTable& table, const ParamValues& fixed) {
  return AlbedoOutput(info, table, fixed).statements();
}

}  // namespace brdfc::forms
