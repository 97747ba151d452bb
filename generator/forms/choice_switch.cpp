// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/choice_switch.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "print/osl_text.h"

namespace brdfc::forms {
namespace {

/// Whether every value of choice k stands in the combinations with the others as in c.
bool covers(const std::vector<Choices>& combinations, Choices c, std::size_t k, int size) {
  for (int i = 0; i < size; ++i) {
    c[k] = i;
    if (std::find(combinations.begin(), combinations.end(), c) == combinations.end()) return false;
  }
  return true;
}

}  // namespace

void ChoiceSwitch::add(const Choices& choices, const std::string& statements) {
  for (auto& [text, combinations] : cases_)
    if (text == statements) {
      combinations.push_back(choices);
      return;
    }
  cases_.push_back({statements, {choices}});
}

std::string ChoiceSwitch::print(int indent) const {
  if (cases_.size() == 1) return cases_[0].first;
  std::string out;
  for (std::size_t i = 0; i < cases_.size(); ++i) {
    const bool last = i + 1 == cases_.size();
    out += fmt::format("{:{}}{}{}{{\n", "", indent, i == 0 ? "" : "} else ",
                       i > 0 && last ? "" : "if (" + condition(cases_[i].second) + ") ");
    out += print::indented(cases_[i].first);
  }
  if (!out.empty()) out += fmt::format("{:{}}}}\n", "", indent);
  return out;
}

std::string ChoiceSwitch::condition(const std::vector<Choices>& combinations) const {
  // Only the choices that tell these combinations from the others need a test.
  std::set<std::string> alternatives;
  for (const Choices& c : combinations) {
    std::string all;
    std::size_t k = 0;
    for (const ParamInfo& p : info_.params) {
      if (p.kind != ParamKind::Choice) continue;
      const int index = c[k];
      if (p.choices.size() > 1 && !fixed_.count(p.name) && !covers(combinations, c, k, int(p.choices.size())))
        all += (all.empty() ? "" : " && ") + fmt::format("{} == {}", p.name, index);
      ++k;
    }
    alternatives.insert(all.empty() ? "1" : all);
  }
  std::string text;
  for (const std::string& a : alternatives)
    text += (text.empty() ? "" : " || ") + (alternatives.size() > 1 ? "(" + a + ")" : a);
  return text;
}

std::string SharedArrays::without_shared(const Recording& r) {
  std::string own;
  for (const std::string& array : r.arrays) {
    const std::string name = array.substr(0, array.find('['));
    if (known_.emplace(name, array).first->second != array) own += array;
  }
  return own + r.statements;
}

std::string SharedArrays::print() const {
  std::string out;
  for (const auto& [name, array] : known_) out += array;
  return out;
}

}  // namespace brdfc::forms
