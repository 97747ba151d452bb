// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/choice_switch.h"

#include <algorithm>
#include <set>

#include "print/osl_program.h"

namespace brdfc::forms {
namespace {

using print::Statements;
using print::Value;

/// True if `combinations` contains c with every value of choice k.
bool covers(const std::vector<Choices>& combinations, Choices c, std::size_t k, int size) {
  for (int i = 0; i < size; ++i) {
    c[k] = i;
    if (std::find(combinations.begin(), combinations.end(), c) == combinations.end()) return false;
  }
  return true;
}

}  // namespace

void ChoiceSwitch::add(const Choices& choices, Statements statements) {
  for (auto& [known, combinations] : cases_)
    if (known == statements) {
      combinations.push_back(choices);
      return;
    }
  cases_.push_back({std::move(statements), {choices}});
}

Statements ChoiceSwitch::statements() const {
  if (cases_.empty()) return {};
  if (cases_.size() == 1) return cases_[0].first;
  print::Cases all;
  for (const auto& [statements, combinations] : cases_) all.cases.push_back({condition(combinations), statements});
  return {all};
}

Value ChoiceSwitch::condition(const std::vector<Choices>& combinations) const {
  // Test only the choices that distinguish these combinations from the others.
  std::set<std::vector<std::pair<std::string, int>>> alternatives;
  for (const Choices& c : combinations) {
    std::vector<std::pair<std::string, int>> tested;
    std::size_t k = 0;
    for (const ParamInfo& p : info_.params) {
      if (p.kind != ParamKind::Choice) continue;
      if (p.choices.size() > 1 && !fixed_.count(p.name) && !covers(combinations, c, k, int(p.choices.size())))
        tested.push_back({p.name, c[k]});
      ++k;
    }
    alternatives.insert(tested);
  }
  std::vector<Value> conditions;
  for (const auto& tested : alternatives) {
    std::vector<Value> all;
    for (const auto& [name, index] : tested) all.push_back(print::operation(name, "==", index));
    const Value one = all.empty() ? Value(1) : print::all_of(all);
    conditions.push_back(alternatives.size() > 1 ? Value(Value::Kind::Group, "", {one}) : one);
  }
  return print::any_of(conditions);
}

Statements SharedArrays::run(const Recording& r) {
  Statements out;
  for (const print::ProgramArray& array : print::osl_arrays(*r.program, r.taken))
    if (known_.emplace(array.name, array.table).first->second->values != array.table->values)
      out.push_back(print::Array{array.name, array.table->values});
  if (!r.program->outputs().empty()) out.push_back(print::Run{r.program, r.taken});
  return out;
}

Statements SharedArrays::declarations() const {
  Statements out;
  for (const auto& [name, table] : known_) out.push_back(print::Array{name, table->values});
  return out;
}

}  // namespace brdfc::forms
