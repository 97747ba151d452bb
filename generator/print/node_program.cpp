// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/node_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "print/node_lowering.h"
#include "print/node_table.h"

namespace brdfc::print {
namespace {

constexpr double kE = 2.718281828459045;

/// Writes the result of lowered_to_nodes(), depth first, so that few values are alive at once.
class Writer {
 public:
  /// `cuts`: values that are inputs with these names, by node. `vectors`: see node_program().
  Writer(const Program& program, std::map<int, std::string> cuts, const std::set<std::string>& vectors)
      : p_(program),
        cuts_(std::move(cuts)),
        vectors_(vectors),
        uses_(std::size_t(program.size())),
        need_(std::size_t(program.size()), -1) {}

  NodeProgram write(const std::vector<std::pair<std::string, int>>& outputs) {
    for (const auto& [name, id] : outputs) count_uses(id);
    // A vector that is built for an output is available to other nodes as well.
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      if (base_of(outputs[i].first, 'x').empty()) continue;
      const Triple triple = {outputs[i].second, outputs.at(i + 1).second, outputs.at(i + 2).second};
      if (same(triple) || plan(triple)) continue;
      planned_[triple] = Joined{};
      combined_.insert(triple);
    }
    for (int id = 0; id < p_.size(); ++id)
      if (uses_[std::size_t(id)] > 0) find_dot(id);
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const std::string base = base_of(outputs[i].first, 'x');
      if (base.empty()) {
        out_.outputs.push_back({outputs[i].first, operand(outputs[i].second)});
        continue;
      }
      const Triple triple = {outputs[i].second, outputs.at(i + 1).second, outputs.at(i + 2).second};
      out_.outputs.push_back({base, plan(triple) ? vector(triple) : combined(triple)});
      i += 2;
    }
    count_live();
    return std::move(out_);
  }

 private:
  /// A truth value: the result of a node, or its negation.
  struct Truth {
    NodeOperand value;
    bool inverted;
  };

  /// x, y and z of a vector.
  using Triple = std::array<int, 3>;
  /// The operands of three equal operations, grouped into vectors, or into numbers that all three share.
  struct Joined {
    std::vector<Triple> operands;
  };

  bool is_color(int id) const { return p_.node(id).type == ExprType::Color; }

  /// NAME if `name` is NAME_x (or _y or _z, according to `axis`) for a vector NAME; otherwise empty.
  std::string base_of(const std::string& name, char axis) const {
    if (name.size() < 3 || name[name.size() - 2] != '_' || name.back() != axis) return "";
    const std::string base = name.substr(0, name.size() - 2);
    return vectors_.count(base) ? base : "";
  }
  std::string input_of(const Triple& t) const {
    std::string base;
    for (std::size_t c = 0; c < 3; ++c) {
      const ExprNode& n = p_.node(t[c]);
      const std::string of = n.op == Op::Input && !cuts_.count(t[c]) ? base_of(n.name, "xyz"[c]) : "";
      if (of.empty() || (c > 0 && of != base)) return "";
      base = of;
    }
    return base;
  }
  bool all(const Triple& t, Op op) const {
    return std::ranges::all_of(t, [&](int id) { return p_.node(id).op == op && !cuts_.count(id); });
  }
  static bool same(const Triple& t) { return t[0] == t[1] && t[1] == t[2]; }

  /// True if the three numbers form a vector that nodes can compute in one operation.
  bool plan(const Triple& t) {
    if (same(t)) return false;
    if (all(t, Op::Const) || !input_of(t).empty()) return true;
    if (const auto it = planned_.find(t); it != planned_.end()) return it->second.has_value();
    planned_[t] = join(t);
    return planned_[t].has_value();
  }
  std::optional<Joined> join(const Triple& t) {
    const Op op = p_.node(t[0]).op;
    if (!all(t, op)) return std::nullopt;
    const auto argument = [&](std::size_t c, std::size_t i) { return p_.node(t[c]).args[i]; };
    const auto column = [&](std::size_t i) { return Triple{argument(0, i), argument(1, i), argument(2, i)}; };
    switch (op) {
      case Op::Neg:
        if (plan(column(0))) return Joined{{column(0)}};
        return std::nullopt;
      case Op::Select:
        if (same(column(0)) && (plan(column(1)) || plan(column(2)))) return Joined{{column(0), column(1), column(2)}};
        return std::nullopt;
      case Op::Sub:
        if (plan(column(0)) && plan(column(1))) return Joined{{column(0), column(1)}};
        return std::nullopt;
      case Op::Div:
        if (plan(column(0)) && (same(column(1)) || plan(column(1)))) return Joined{{column(0), column(1)}};
        return std::nullopt;
      case Op::Add:
      case Op::Mul:
        // Try both orders of the operands in each of the three.
        for (unsigned turned = 0; turned < 8; ++turned) {
          const auto at = [&](std::size_t c, std::size_t i) { return argument(c, (turned >> c & 1) ? 1 - i : i); };
          const Triple first = {at(0, 0), at(1, 0), at(2, 0)}, second = {at(0, 1), at(1, 1), at(2, 1)};
          if (plan(first) && (plan(second) || (op == Op::Mul && same(second)))) return Joined{{first, second}};
        }
        return std::nullopt;
      default:
        return std::nullopt;
    }
  }

  NodeOperand combined(const Triple& t) {
    std::vector<NodeOperand> parts;
    for (int id : t) parts.push_back(operand(id));
    return add("COMBINE", parts, true);
  }

  /// The vector for a triple that plan() accepts.
  NodeOperand vector(const Triple& t) {
    if (const std::string base = input_of(t); !base.empty()) return input(base, true);
    if (all(t, Op::Const))
      return {-1, "", {p_.node(t[0]).value[0], p_.node(t[1]).value[0], p_.node(t[2]).value[0]}, true};
    if (const auto it = made_.find(t); it != made_.end()) return it->second;
    if (combined_.count(t)) return made_[t] = combined(t);
    return made_[t] = make_vector(t, planned_.at(t)->operands);
  }
  NodeOperand make_vector(const Triple& t, const std::vector<Triple>& of) {
    switch (p_.node(t[0]).op) {
      case Op::Neg:
        return add("V_SCALE", {vector(of[0]), number(-1)}, true);
      case Op::Add:
        return add("V_ADD", {vector(of[0]), vector(of[1])}, true);
      case Op::Sub:
        return add("V_SUBTRACT", {vector(of[0]), vector(of[1])}, true);
      case Op::Mul:
        if (same(of[1])) return add("V_SCALE", {vector(of[0]), operand(of[1][0])}, true);
        return add("V_MULTIPLY", {vector(of[0]), vector(of[1])}, true);
      case Op::Div:
        if (same(of[1]))
          return add("V_SCALE", {vector(of[0]), add("DIVIDE", {number(1), operand(of[1][0])}, false)}, true);
        return add("V_DIVIDE", {vector(of[0]), vector(of[1])}, true);
      default: {
        const Truth chosen = truth(of[0][0]);
        const auto arm = [&](const Triple& a) { return plan(a) ? vector(a) : combined(a); };
        const NodeOperand yes = arm(of[1]), no = arm(of[2]);
        return add("V_MIX", {chosen.value, chosen.inverted ? yes : no, chosen.inverted ? no : yes}, true);
      }
    }
  }

  /// Records a sum of three products as a dot product, if its factors are the components of two vectors.
  void find_dot(int id) {
    const auto product = [&](int a) {
      return p_.node(a).op == Op::Mul && p_.node(a).type == ExprType::Real && !cuts_.count(a);
    };
    const ExprNode& n = p_.node(id);
    if (n.op != Op::Add || n.type != ExprType::Real || cuts_.count(id)) return;
    for (const std::size_t i : {0, 1}) {
      const int sum = n.args[i], last = n.args[1 - i];
      const ExprNode& s = p_.node(sum);
      if (s.op != Op::Add || cuts_.count(sum) || !product(last) || !product(s.args[0]) || !product(s.args[1])) continue;
      const Triple products = {s.args[0], s.args[1], last};
      for (unsigned turned = 0; turned < 8; ++turned) {
        const auto at = [&](std::size_t c, std::size_t k) {
          return p_.node(products[c]).args[(turned >> c & 1) ? 1 - k : k];
        };
        const Triple a = {at(0, 0), at(1, 0), at(2, 0)}, b = {at(0, 1), at(1, 1), at(2, 1)};
        if (!plan(a) || !plan(b)) continue;
        dots_[id] = {a, b};
        take_parts(a);
        take_parts(b);
        return;
      }
    }
  }
  /// Takes the components of a vector from its node.
  void take_parts(const Triple& t) {
    if (all(t, Op::Const) || !input_of(t).empty() || combined_.count(t) || !taken_.insert(t).second) return;
    for (std::size_t c = 0; c < 3; ++c)
      if (p_.node(t[c]).op != Op::Const) part_of_.try_emplace(t[c], t, c);
    for (const Triple& of : planned_.at(t)->operands)
      if (plan(of)) take_parts(of);
  }

  void count_uses(int id) {
    if (uses_[std::size_t(id)]++ > 0 || cuts_.count(id)) return;
    for (int a : p_.node(id).args) count_uses(a);
  }

  /// Number of registers that the value would need if it were a tree (R. Sethi, J. Ullman: The Generation of Optimal
  /// Code for Arithmetic Expressions, 1970).
  int need(int id) {
    int& known = need_[std::size_t(id)];
    if (known >= 0) return known;
    if (cuts_.count(id) || p_.node(id).op == Op::Const || p_.node(id).op == Op::Input) return known = 0;
    int held = 0, most = is_color(id) ? 3 : 1;
    for (int a : by_need(id)) {
      most = std::max(most, held + need(a));
      held += is_color(a) ? 3 : 1;
    }
    return known = most;
  }
  std::vector<int> by_need(int id) {
    std::vector<int> args = p_.node(id).args;
    std::ranges::stable_sort(args, [&](int a, int b) { return need(a) > need(b); });
    return args;
  }

  NodeOperand operand(int id) {
    if (const auto it = known_.find(id); it != known_.end()) return it->second;
    return known_[id] = make(id);
  }
  NodeOperand input(const std::string& name, bool color) {
    if (std::ranges::find(out_.inputs, std::pair(name, color)) == out_.inputs.end())
      out_.inputs.push_back({name, color});
    return {-1, name, {}, color};
  }
  static NodeOperand number(double x) { return {-1, "", {x, x, x}, false}; }

  NodeOperand add(const std::string& kind, const std::vector<NodeOperand>& operands, bool color,
                  const std::shared_ptr<const Table>& table = nullptr) {
    int places = 0;
    for (const NodeOperand& o : operands) places += o.result;
    std::vector<int>& alike = of_kind_[{kind, places}];
    for (const int i : alike) {
      const NodeOperation& o = out_.operations[std::size_t(i)];
      if (o.operands == operands && o.table == table) return {i, "", {}, color};
    }
    out_.operations.push_back({kind, operands, color, table});
    alike.push_back(int(out_.operations.size()) - 1);
    return {alike.back(), "", {}, color};
  }

  /// True if the value has no other use, so that it can become part of another node.
  bool own(int id) const {
    return uses_[std::size_t(id)] == 1 && !cuts_.count(id) && !known_.count(id) && !part_of_.count(id) &&
           !dots_.count(id);
  }

  /// a b + c in one node, where one of the summands is a product.
  std::optional<NodeOperand> multiply_add(const ExprNode& n) {
    const bool color = n.type == ExprType::Color;
    for (const std::size_t i : {0, 1}) {
      const int product = n.args[i], other = n.args[1 - i];
      const ExprNode& p = p_.node(product);
      if (p.op != Op::Mul || !own(product) || p.type != n.type) continue;
      NodeOperand added;
      const ExprNode& o = p_.node(other);
      const bool constant = o.op == Op::Const;
      if (n.op == Op::Sub && i == 1) {
        if (color) continue;
        return minus_product(p.args, other);
      }
      if (n.op == Op::Sub && !constant) continue;
      // Operands that need more registers come first.
      std::vector<int> order = {p.args[0], p.args[1], other};
      std::ranges::stable_sort(order, [&](int a, int b) { return need(a) > need(b); });
      for (int a : order) operand(a);
      added = operand(other);
      if (n.op == Op::Sub)
        for (double& x : added.value) x = -x;
      return add(color ? "V_MULTIPLY_ADD" : "MULTIPLY_ADD", {operand(p.args[0]), operand(p.args[1]), added}, color);
    }
    return std::nullopt;
  }

  /// Writes c - a b as c + (-a) b. The value -a is often needed several times, because polynomials have this form.
  NodeOperand minus_product(const std::vector<int>& factors, int from) {
    int turned = factors[0], other = factors[1];
    if (p_.node(other).op == Op::Const || uses_[std::size_t(other)] > uses_[std::size_t(turned)])
      std::swap(turned, other);
    std::vector<int> order = {turned, other, from};
    std::ranges::stable_sort(order, [&](int a, int b) { return need(a) > need(b); });
    for (int a : order) operand(a);
    const NodeOperand a = operand(turned);
    const NodeOperand minus = a.is_constant() ? number(-a.value[0]) : add("MULTIPLY", {a, number(-1)}, false);
    return add("MULTIPLY_ADD", {minus, operand(other), operand(from)}, false);
  }

  NodeOperand make(int id) {
    const ExprNode& n = p_.node(id);
    const bool color = n.type == ExprType::Color;
    if (const auto cut = cuts_.find(id); cut != cuts_.end()) return input(cut->second, color);
    if (n.op == Op::Const) return {-1, "", n.value, color};
    if (n.op == Op::Input) {
      for (const char axis : {'x', 'y', 'z'})
        if (const std::string base = base_of(n.name, axis); !base.empty())
          return add(std::string(1, char(axis - 'x' + 'X')), {input(base, true)}, false);
      return input(n.name, color);
    }
    if (const auto dot = dots_.find(id); dot != dots_.end())
      return add("V_DOT_PRODUCT", {vector(dot->second[0]), vector(dot->second[1])}, false);
    if (const auto part = part_of_.find(id); part != part_of_.end())
      return add(std::string(1, "XYZ"[part->second.second]), {vector(part->second.first)}, false);
    if (n.type == ExprType::Bool) {
      const Truth t = truth(id);
      return t.inverted ? add("SUBTRACT", {number(1), t.value}, false) : t.value;
    }
    if (n.op == Op::Add || n.op == Op::Sub)
      if (const auto made = multiply_add(n)) return *made;
    if (n.op == Op::Select) return select_node(n, color);
    for (int a : by_need(id)) operand(a);
    std::vector<NodeOperand> args;
    for (int a : n.args) args.push_back(operand(a));
    switch (n.op) {
      case Op::Add:
        return add(color ? "V_ADD" : "ADD", args, color);
      case Op::Sub:
        return add(color ? "V_SUBTRACT" : "SUBTRACT", args, color);
      case Op::Mul:
        if (color && !args[1].color) return add("V_SCALE", args, true);
        if (color && !args[0].color) return add("V_SCALE", {args[1], args[0]}, true);
        return add(color ? "V_MULTIPLY" : "MULTIPLY", args, color);
      case Op::Div:
        return add(color ? "V_DIVIDE" : "DIVIDE", args, color);
      case Op::Neg:
        return color ? add("V_SCALE", {args[0], number(-1)}, true) : add("MULTIPLY", {args[0], number(-1)}, false);
      case Op::Sqrt:
        return color ? by_channel("SQRT", args[0]) : add("SQRT", args, false);
      case Op::Exp:
        return color ? by_channel("EXPONENT", args[0]) : add("EXPONENT", args, false);
      case Op::Log:
        return color ? by_channel("LOGARITHM", args[0], kE) : add("LOGARITHM", {args[0], number(kE)}, false);
      case Op::Sin:
        return add("SINE", args, false);
      case Op::Cos:
        return add("COSINE", args, false);
      case Op::Atan:
        return add("ARCTANGENT", args, false);
      case Op::Pow:
        return add("POWER", args, false);
      case Op::Abs:
        return add("ABSOLUTE", args, false);
      case Op::Min:
        return add("MINIMUM", args, false);
      case Op::Max:
        return add("MAXIMUM", args, false);
      case Op::MaxComponent: {
        if (!args[0].color) return args[0];
        const NodeOperand x = add("X", args, false), y = add("Y", args, false), z = add("Z", args, false);
        return add("MAXIMUM", {x, add("MAXIMUM", {y, z}, false)}, false);
      }
      case Op::MakeColor:
        return add("COMBINE", args, true);
      case Op::Lookup:
        return add("LOOKUP", args, false, n.table);
      default:
        throw ExprError(std::string("no node for ") + name_of(n.op));
    }
  }

  /// A function of each channel; with a second operand if there is one.
  NodeOperand by_channel(const char* kind, const NodeOperand& color, std::optional<double> second = std::nullopt) {
    std::vector<NodeOperand> channels;
    for (const char* c : {"X", "Y", "Z"}) {
      std::vector<NodeOperand> operands = {add(c, {color}, false)};
      if (second) operands.push_back(number(*second));
      channels.push_back(add(kind, operands, false));
    }
    return add("COMBINE", channels, true);
  }

  NodeOperand select_node(const ExprNode& n, bool color) {
    int yes = n.args[1], no = n.args[2];
    std::vector<int> order = n.args;
    std::ranges::stable_sort(order, [&](int a, int b) { return need(a) > need(b); });
    std::optional<Truth> chosen;
    for (int a : order) {
      if (a == n.args[0])
        chosen = truth(a);
      else
        operand(a);
    }
    if (chosen->inverted) std::swap(yes, no);
    const NodeOperand a = operand(yes), b = operand(no);
    const auto is = [](const NodeOperand& x, double v) {
      return x.is_constant() && x.value == std::array<double, 3>{v, v, v};
    };
    if (is(b, 0)) {
      if (color) return add("V_SCALE", {a, chosen->value}, true);
      return is(a, 1) ? chosen->value : add("MULTIPLY", {a, chosen->value}, false);
    }
    if (!color && is(a, 0) && is(b, 1)) return add("SUBTRACT", {number(1), chosen->value}, false);
    return add(color ? "V_MIX" : "MIX", {chosen->value, b, a}, color);
  }

  Truth truth(int id) {
    const ExprNode& n = p_.node(id);
    if (cuts_.count(id) || n.op == Op::Const || n.op == Op::Input) return {operand(id), false};
    if (const auto it = truths_.find(id); it != truths_.end()) return it->second;
    Truth out{{}, false};
    if (n.op == Op::Not) {
      out = truth(n.args[0]);
      out.inverted = !out.inverted;
    } else if (n.op == Op::And || n.op == Op::Or) {
      // not a and not b = not (a or b)
      const Truth a = truth(n.args[0]), b = truth(n.args[1]);
      const bool both = a.inverted && b.inverted, product = (n.op == Op::And) != both;
      const auto plain = [&](const Truth& t) {
        return t.inverted && !both ? add("SUBTRACT", {number(1), t.value}, false) : t.value;
      };
      out = {add(product ? "MULTIPLY" : "MAXIMUM", {plain(a), plain(b)}, false), both};
    } else {
      for (int a : by_need(id)) operand(a);
      const NodeOperand a = operand(n.args[0]), b = operand(n.args[1]);
      // a <= b unless b < a
      out = n.op == Op::Less ? Truth{add("LESS_THAN", {a, b}, false), false}
                             : Truth{add("LESS_THAN", {b, a}, false), true};
    }
    return truths_.emplace(id, out).first->second;
  }

  void count_live() {
    std::vector<int> last(out_.operations.size(), -1);
    for (std::size_t i = 0; i < out_.operations.size(); ++i)
      for (const NodeOperand& o : out_.operations[i].operands)
        if (o.result >= 0) last[std::size_t(o.result)] = int(i);
    for (const auto& [name, o] : out_.outputs)
      if (o.result >= 0) last[std::size_t(o.result)] = int(out_.operations.size());
    int live = 0;
    std::vector<int> dying(out_.operations.size() + 1, 0);
    for (std::size_t i = 0; i < out_.operations.size(); ++i) {
      const int size = out_.operations[i].color ? 3 : 1;
      live += size;
      out_.live = std::max(out_.live, live);
      if (last[i] >= 0) dying[std::size_t(last[i])] += size;
      live -= dying[i];
    }
  }

  const Program& p_;
  std::map<int, std::string> cuts_;
  const std::set<std::string>& vectors_;
  std::map<Triple, std::optional<Joined>> planned_;
  std::map<Triple, NodeOperand> made_;
  std::map<int, std::array<Triple, 2>> dots_;
  std::set<Triple> taken_, combined_;
  std::map<int, std::pair<Triple, std::size_t>> part_of_;
  std::vector<int> uses_, need_;
  std::map<int, NodeOperand> known_;
  std::map<int, Truth> truths_;
  /// Indices of the operations, by kind and the sum of the operands' indices, to find one that is there already.
  std::map<std::pair<std::string, int>, std::vector<int>> of_kind_;
  NodeProgram out_;
};

}  // namespace

bool has_nodes(const Program& program) {
  for (int id = 0; id < program.size(); ++id)
    if (program.reachable()[std::size_t(id)] && program.node(id).op == Op::Lookup &&
        !polynomial_of(*program.node(id).table))
      return false;
  return true;
}

NodeProgram node_program(const Program& program, const std::set<std::string>& vectors) {
  const Program p = lowered_to_nodes(program);
  return Writer(p, {}, vectors).write(p.outputs());
}

NodePrograms node_programs(const Program& program, const std::set<std::string>& varying, const std::string& prefix,
                           const std::vector<std::set<std::string>>& outputs, const std::set<std::string>& vectors) {
  const Program p = lowered_to_nodes(program);
  const std::vector<bool>& reachable = p.reachable();
  std::vector<bool> varies(reachable.size());
  std::map<int, std::string> cuts;
  std::vector<std::pair<std::string, int>> passed;
  const auto pass = [&](int id) {
    const Op op = p.node(id).op;
    if (varies[std::size_t(id)] || op == Op::Const || op == Op::Input || cuts.count(id)) return;
    cuts[id] = fmt::format("{}{}", prefix, cuts.size());
    passed.push_back({cuts[id], id});
  };
  for (int id = 0; id < p.size(); ++id) {
    const ExprNode& n = p.node(id);
    if (!reachable[std::size_t(id)]) continue;
    bool any = n.op == Op::Input && varying.count(n.name);
    for (int a : n.args) any = any || varies[std::size_t(a)];
    varies[std::size_t(id)] = any;
    if (any)
      for (int a : n.args) pass(a);
  }
  for (const auto& [name, id] : p.outputs()) pass(id);
  NodePrograms out{Writer(p, {}, vectors).write(passed), {}};
  for (const std::set<std::string>& names : outputs) {
    auto wanted = p.outputs();
    std::erase_if(wanted, [&](const auto& output) { return !names.count(output.first); });
    out.each.push_back(Writer(p, cuts, vectors).write(wanted));
  }
  return out;
}

}  // namespace brdfc::print
