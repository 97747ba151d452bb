// SPDX-License-Identifier: GPL-3.0-or-later
#include "forms/node_choices.h"

#include <algorithm>
#include <compare>
#include <iterator>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "print/node_lowering.h"

namespace brdfc::forms {
namespace {

/// The combinations of choices that agree with `fixed`.
std::vector<Choices> open_choices(const ModelInfo& info, const ParamValues& fixed) {
  std::vector<Choices> out = choice_combinations(info);
  std::erase_if(out, [&](const Choices& choices) { return !admits(info, choices, fixed); });
  return out;
}

/// Merges the programs of all combinations of choices, operation by operation. Where all programs have the same
/// operation it is written once, with merged arguments; where they differ, the choice selects. So combinations that
/// differ only in a parameter of a formula select that parameter, not one of several formulas.
class Merger {
 public:
  /// A node of one of the programs.
  struct Place {
    std::size_t program;
    int node;
    auto operator<=>(const Place&) const = default;
  };
  using Places = std::vector<Place>;

  Merger(const ModelInfo& info, const ParamValues& fixed, const std::vector<Program>& programs)
      : programs_(programs), options_(open_choices(info, fixed)) {
    for (const ParamInfo& p : info.params)
      if (p.kind == ParamKind::Choice) names_.push_back(p.name);
  }

  /// The node of the current recorder that represents all these nodes.
  int merged(const Places& places) {
    if (const auto it = known_.find(places); it != known_.end()) return it->second;
    const int made = alike(places) ? together(places) : selected(places);
    return known_[places] = made;
  }

 private:
  const ExprNode& node(const Place& p) const { return programs_[p.program].node(p.node); }
  bool alike(const Places& places) const {
    const ExprNode& a = node(places[0]);
    return std::ranges::all_of(places, [&](const Place& p) {
      const ExprNode& b = node(p);
      return a.op == b.op && a.type == b.type && a.args.size() == b.args.size() && a.value == b.value &&
             a.name == b.name && a.index == b.index && a.table == b.table;
    });
  }

  int together(const Places& places) {
    ExprNode n = node(places[0]);
    for (std::size_t k = 0; k < n.args.size(); ++k) {
      Places of;
      for (const Place& p : places) of.push_back({p.program, node(p).args[k]});
      n.args[k] = merged(of);
    }
    return Recorder::current().add(std::move(n));
  }

  /// Groups the places by the option of one choice.
  std::map<int, Places> split(const Places& places, std::size_t choice) const {
    std::map<int, Places> out;
    for (const Place& p : places) out[options_[p.program][choice]].push_back(p);
    return out;
  }

  /// Selects by a choice: by the one that alone explains the differences, if there is one.
  int selected(const Places& places) {
    std::optional<std::size_t> by;
    for (std::size_t choice = 0; choice < names_.size(); ++choice) {
      const std::map<int, Places> groups = split(places, choice);
      if (groups.size() < 2) continue;
      const bool settles = std::ranges::all_of(groups, [&](const auto& group) { return alike(group.second); });
      if (!by || settles) by = choice;
      if (settles) break;
    }
    // Options with the same operation are merged.
    std::vector<Places> together;
    std::vector<std::pair<int, std::size_t>> taken;  // options, and the index in `together` of each
    for (const auto& [option, group] : split(places, by.value())) {
      std::size_t at = 0;
      for (; at < together.size(); ++at) {
        Places both = together[at];
        both.insert(both.end(), group.begin(), group.end());
        if (!alike(both)) continue;
        std::ranges::sort(both);
        together[at] = both;
        break;
      }
      if (at == together.size()) together.push_back(group);
      taken.push_back({option, at});
    }
    int out = merged(together[taken.back().second]);
    for (auto it = std::next(taken.rbegin()); it != taken.rend(); ++it)
      out = chosen(Expr::input(names_[*by]) < Expr(it->first + 0.5), merged(together[it->second]), out,
                   node(places[0]).type);
    return out;
  }

  static int chosen(const Condition& c, int a, int b, ExprType type) {
    if (a == b) return a;
    switch (type) {
      case ExprType::Real:
        return select(c, Expr::of_node(a), Expr::of_node(b)).id();
      case ExprType::Color:
        return select(c, Rgb<Expr>::of_node(a), Rgb<Expr>::of_node(b)).id();
      case ExprType::Bool:
        return ((c && Condition::of_node(a)) || (!c && Condition::of_node(b))).id();
    }
    throw std::logic_error("a value of unknown type");
  }

  const std::vector<Program>& programs_;
  std::vector<Choices> options_;    ///< of each program
  std::vector<std::string> names_;  ///< of all choices
  std::map<Places, int> known_;
};

}  // namespace

std::vector<ParamValues> open_combinations(const ModelInfo& info, const ParamValues& fixed) {
  std::vector<ParamValues> out;
  for (const Choices& choices : open_choices(info, fixed)) out.push_back(with_choices(info, choices, fixed));
  return out;
}

Program selected_by_choices(const ModelInfo& info, const ParamValues& fixed,
                            const std::vector<Program>& by_combination) {
  // Unroll loops first, because loop bodies can't be shared.
  std::vector<Program> lowered;
  for (const Program& p : by_combination) lowered.push_back(print::lowered_to_nodes(p));
  Merger merger(info, fixed, lowered);
  Program out;
  for (std::size_t i = 0; i < lowered.at(0).outputs().size(); ++i) {
    const auto& [name, first] = lowered[0].outputs()[i];
    Merger::Places places;
    for (std::size_t p = 0; p < lowered.size(); ++p) places.push_back({p, lowered[p].outputs().at(i).second});
    const int node = merger.merged(places);
    if (lowered[0].node(first).type == ExprType::Color)
      out.output(name, Rgb<Expr>::of_node(node));
    else
      out.output(name, Expr::of_node(node));
  }
  return out;
}

}  // namespace brdfc::forms
