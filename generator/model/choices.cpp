// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/choices.h"

#include <algorithm>

namespace brdfc::inline model {

std::vector<Choices> choice_combinations(const ModelInfo& info) {
  std::vector<Choices> all = {{}};
  for (const ParamInfo& p : info.params) {
    if (p.kind != ParamKind::Choice) continue;
    std::vector<Choices> longer;
    for (const Choices& c : all)
      for (int i = 0; i < int(p.choices.size()); ++i) {
        longer.push_back(c);
        longer.back().push_back(i);
      }
    all = std::move(longer);
  }
  return all;
}

std::vector<std::string> options_of(const ModelInfo& info, const Choices& choices) {
  std::vector<std::string> out;
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Choice) out.push_back(p.choices[std::size_t(choices.at(out.size()))]);
  return out;
}

ParamValues with_choices(const ModelInfo& info, const Choices& choices, ParamValues values) {
  std::size_t k = 0;
  for (const ParamInfo& p : info.params)
    if (p.kind == ParamKind::Choice) values[p.name] = p.choices[std::size_t(choices.at(k++))];
  return values;
}

bool admits(const ModelInfo& info, const Choices& choices, const ParamValues& fixed) {
  const ParamValues values = with_choices(info, choices);
  return std::all_of(values.begin(), values.end(), [&](const auto& item) {
    const auto it = fixed.find(item.first);
    return it == fixed.end() || it->second == item.second;
  });
}

}  // namespace brdfc::inline model
