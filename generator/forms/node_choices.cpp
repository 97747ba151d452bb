// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/node_choices.h"

#include <string>

namespace brdfc::forms {
namespace {

/// Selects one node for each output, from those of the combinations.
class Selection {
 public:
  Selection(const ModelInfo& info, const ParamValues& fixed, bool color) : color_(color) {
    for (const ParamInfo& p : info.params)
      if (p.kind == ParamKind::Choice && !fixed.count(p.name)) choices_.push_back(&p);
  }

  /// Of nodes by combination, of which the last choice varies fastest.
  int among(const std::vector<int>& nodes) const { return among(nodes, 0, 0, nodes.size()); }

 private:
  int among(const std::vector<int>& nodes, std::size_t level, std::size_t first, std::size_t count) const {
    if (level == choices_.size()) return nodes.at(first);
    const std::size_t options = choices_[level]->choices.size(), each = count / options;
    int out = among(nodes, level + 1, first + (options - 1) * each, each);
    for (std::size_t i = options - 1; i-- > 0;) {
      const int here = among(nodes, level + 1, first + i * each, each);
      if (here == out) continue;
      const Condition chosen = Expr::input(choices_[level]->name) < Expr(double(i) + 0.5);
      out = color_ ? select(chosen, Rgb<Expr>::of_node(here), Rgb<Expr>::of_node(out)).id()
                   : select(chosen, Expr::of_node(here), Expr::of_node(out)).id();
    }
    return out;
  }

  bool color_;
  std::vector<const ParamInfo*> choices_;
};

}  // namespace

std::vector<ParamValues> open_combinations(const ModelInfo& info, const ParamValues& fixed) {
  std::vector<ParamValues> out;
  for (const Choices& choices : choice_combinations(info))
    if (admits(info, choices, fixed)) out.push_back(with_choices(info, choices, fixed));
  return out;
}

Program selected_by_choices(const ModelInfo& info, const ParamValues& fixed,
                            const std::vector<Program>& by_combination) {
  Program out;
  for (std::size_t i = 0; i < by_combination.at(0).outputs().size(); ++i) {
    const auto& [name, first] = by_combination[0].outputs()[i];
    const bool color = by_combination[0].node(first).type == ExprType::Color;
    std::vector<int> nodes;
    for (const Program& p : by_combination) nodes.push_back(p.outputs().at(i).second);
    const int node = Selection(info, fixed, color).among(nodes);
    if (color)
      out.output(name, Rgb<Expr>::of_node(node));
    else
      out.output(name, Expr::of_node(node));
  }
  return out;
}

}  // namespace brdfc::forms
