// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/node_program.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "core/series.h"

namespace brdfc::print {
namespace {

/// A value of the program as it is recorded anew.
struct NodeValue {
  ExprType type = ExprType::Real;
  Expr real{};
  Rgb<Expr> color{};
  Condition flag{false};

  NodeValue() = default;
  NodeValue(const Expr& x) : real(x) {}                               // NOLINT: one of three
  NodeValue(const Rgb<Expr>& c) : type(ExprType::Color), color(c) {}  // NOLINT
  NodeValue(const Condition& c) : type(ExprType::Bool), flag(c) {}    // NOLINT
  Rgb<Expr> as_color() const { return type == ExprType::Color ? color : Rgb<Expr>(real); }
};

/// Records a program anew with the operations alone that nodes have.
class Lowering {
 public:
  /// `from` holds the program, the current recorder is another one.
  Lowering(const Recorder& from, const Program& program, std::vector<bool> reachable)
      : r_(from), reachable_(std::move(reachable)), values_(reachable_.size()) {
    for (int id = 0; id < int(reachable_.size()); ++id)
      if (reachable_[std::size_t(id)] && r_.node(id).scope < 0) step(id);
    for (const auto& [name, id] : program.outputs()) {
      const NodeValue& v = values_[std::size_t(id)];
      if (v.type == ExprType::Color)
        out_.output(name, v.color);
      else
        out_.output(name, v.real);
    }
  }
  const Program& program() const { return out_; }

 private:
  void step(int id) {
    const ExprNode& n = r_.node(id);
    if (n.op == Op::Loop)
      unroll(id, n);
    else if (n.op == Op::LoopOut)
      values_[std::size_t(id)] = loops_.at(n.args[0])[std::size_t(n.index)];
    else if (n.op != Op::LoopVar)
      values_[std::size_t(id)] = compute(n);
  }

  void unroll(int id, const ExprNode& n) {
    const std::size_t size = n.args.size() / 2;
    const int serial = int(n.value[0]);
    std::vector<NodeValue> state;
    for (std::size_t k = 0; k < size; ++k) state.push_back(arg(n, k));
    for (int i = 0; i < n.index; ++i) {
      for (int body = 0; body < id; ++body) {
        const ExprNode& b = r_.node(body);
        if (b.scope != serial || !reachable_[std::size_t(body)]) continue;
        if (b.op == Op::LoopVar)
          values_[std::size_t(body)] = state[std::size_t(b.index)];
        else
          step(body);
      }
      for (std::size_t k = 0; k < size; ++k) state[k] = arg(n, size + k);
    }
    loops_[id] = std::move(state);
  }

  const NodeValue& arg(const ExprNode& n, std::size_t i) const { return values_[std::size_t(n.args[i])]; }

  NodeValue compute(const ExprNode& n) const {
    const auto real = [&](std::size_t i) -> const Expr& { return arg(n, i).real; };
    const bool color = n.type == ExprType::Color;
    const auto binary = [&](const auto& apply) -> NodeValue {
      if (color) return apply(arg(n, 0).as_color(), arg(n, 1).as_color());
      return apply(real(0), real(1));
    };
    switch (n.op) {
      case Op::Const:
        if (n.type == ExprType::Bool) return Condition(n.value[0] != 0);
        if (color) return Rgb<Expr>(Expr(n.value[0]), Expr(n.value[1]), Expr(n.value[2]));
        return Expr(n.value[0]);
      case Op::Input:
        if (color) return Rgb<Expr>::input(n.name);
        return Expr::input(n.name);
      case Op::Add:
        return binary([](const auto& a, const auto& b) { return a + b; });
      case Op::Sub:
        return binary([](const auto& a, const auto& b) { return a - b; });
      case Op::Mul:
        return binary([](const auto& a, const auto& b) { return a * b; });
      case Op::Div:
        return binary([](const auto& a, const auto& b) { return a / b; });
      case Op::Neg:
        if (color) return arg(n, 0).color * Expr(-1.0);
        return -real(0);
      case Op::Sqrt:
        return sqrt(real(0));
      case Op::Cbrt:
        return select(real(0) < Expr(0.0), Expr(-1.0), Expr(1.0)) * pow(abs(real(0)), Expr(1 / 3.));
      case Op::Exp:
        return exp(real(0));
      case Op::Log:
        return log(real(0));
      case Op::Log1p:
        return series_log1p(real(0), log(Expr(1.0) + real(0)));
      case Op::Expm1:
        return series_expm1(real(0), exp(real(0)));
      case Op::Sin:
        return sin(real(0));
      case Op::Cos:
        return cos(real(0));
      case Op::Atan:
        return atan(real(0));
      case Op::Pow:
        return pow(real(0), real(1));
      case Op::Abs:
        return abs(real(0));
      case Op::Min:
        return minimum(real(0), real(1));
      case Op::Max:
        return maximum(real(0), real(1));
      case Op::Less:
        return real(0) < real(1);
      case Op::LessEqual:
        return real(0) <= real(1);
      case Op::And:
        return arg(n, 0).flag && arg(n, 1).flag;
      case Op::Or:
        return arg(n, 0).flag || arg(n, 1).flag;
      case Op::Not:
        return !arg(n, 0).flag;
      case Op::Select:
        if (color) return select(arg(n, 0).flag, arg(n, 1).as_color(), arg(n, 2).as_color());
        return select(arg(n, 0).flag, real(1), real(2));
      case Op::MaxComponent:
        return max_component(arg(n, 0).as_color());
      case Op::MakeColor:
        return Rgb<Expr>(real(0), real(1), real(2));
      case Op::Lookup: {
        std::vector<Expr> at;
        for (std::size_t i = 0; i < n.args.size(); ++i) at.push_back(real(i));
        return record_lookup(n.table, at);
      }
      default:
        throw ExprError(std::string("no node for ") + name_of(n.op));
    }
  }

  const Recorder& r_;
  std::vector<bool> reachable_;
  std::vector<NodeValue> values_;
  std::map<int, std::vector<NodeValue>> loops_;
  Program out_;
};

/// Writes what Lowering left, depth first, so that few values live at once.
class Writer {
 public:
  /// `cuts`: values that come from elsewhere, by node.
  Writer(const Recorder& r, std::map<int, std::string> cuts)
      : r_(r), cuts_(std::move(cuts)), uses_(std::size_t(r.size())), need_(std::size_t(r.size()), -1) {}

  NodeProgram write(const std::vector<std::pair<std::string, int>>& outputs) {
    for (const auto& [name, id] : outputs) count_uses(id);
    for (const auto& [name, id] : outputs) out_.outputs.push_back({name, operand(id)});
    count_live();
    return std::move(out_);
  }

 private:
  /// A truth value that a node gives, or its opposite.
  struct Truth {
    NodeOperand value;
    bool inverted;
  };

  bool is_color(int id) const { return r_.node(id).type == ExprType::Color; }

  void count_uses(int id) {
    if (uses_[std::size_t(id)]++ > 0 || cuts_.count(id)) return;
    for (int a : r_.node(id).args) count_uses(a);
  }

  /// Registers that a value takes, were it a tree (R. Sethi, J. Ullman: The Generation of Optimal Code for Arithmetic
  /// Expressions, 1970).
  int need(int id) {
    int& known = need_[std::size_t(id)];
    if (known >= 0) return known;
    if (cuts_.count(id) || r_.node(id).op == Op::Const || r_.node(id).op == Op::Input) return known = 0;
    int held = 0, most = is_color(id) ? 3 : 1;
    for (int a : by_need(id)) {
      most = std::max(most, held + need(a));
      held += is_color(a) ? 3 : 1;
    }
    return known = most;
  }
  std::vector<int> by_need(int id) {
    std::vector<int> args = r_.node(id).args;
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
    for (std::size_t i = 0; i < out_.operations.size(); ++i) {
      const NodeOperation& o = out_.operations[i];
      if (o.kind == kind && o.operands == operands && o.table == table) return {int(i), "", {}, color};
    }
    out_.operations.push_back({kind, operands, color, table});
    return {int(out_.operations.size()) - 1, "", {}, color};
  }

  /// Whether nothing else takes the value, which so can be a part of another node.
  bool own(int id) const { return uses_[std::size_t(id)] == 1 && !cuts_.count(id) && !known_.count(id); }

  /// a b + c in one node, where one of the summands is a product.
  std::optional<NodeOperand> multiply_add(const ExprNode& n) {
    const bool color = n.type == ExprType::Color;
    for (const std::size_t i : {0, 1}) {
      const int product = n.args[i], other = n.args[1 - i];
      const ExprNode& p = r_.node(product);
      if (p.op != Op::Mul || !own(product) || p.type != n.type) continue;
      NodeOperand added;
      const ExprNode& o = r_.node(other);
      const bool constant = o.op == Op::Const;
      if (n.op == Op::Sub && !(i == 0 && constant)) continue;
      // What takes more registers first.
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

  NodeOperand make(int id) {
    const ExprNode& n = r_.node(id);
    const bool color = n.type == ExprType::Color;
    if (const auto cut = cuts_.find(id); cut != cuts_.end()) return input(cut->second, color);
    if (n.op == Op::Const) return {-1, "", n.value, color};
    if (n.op == Op::Input) return input(n.name, color);
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
        return add("SQRT", args, false);
      case Op::Exp:
        return add("EXPONENT", args, false);
      case Op::Log:
        return add("LOGARITHM", {args[0], number(2.718281828459045)}, false);
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
    const ExprNode& n = r_.node(id);
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

  const Recorder& r_;
  std::map<int, std::string> cuts_;
  std::vector<int> uses_, need_;
  std::map<int, NodeOperand> known_;
  std::map<int, Truth> truths_;
  NodeProgram out_;
};

/// Calls `use` with the program as it is recorded anew, while that recorder is the current one.
template <class Use> auto with_lowered(const Program& program, const Use& use) {
  const Recorder& from = Recorder::current();
  std::vector<bool> reachable = program.reachable();
  Recorder recorder(from.precision());
  const Lowering lowering(from, program, std::move(reachable));
  return use(recorder, lowering.program());
}

}  // namespace

NodeProgram node_program(const Program& program) {
  return with_lowered(program, [](const Recorder& r, const Program& p) { return Writer(r, {}).write(p.outputs()); });
}

NodePrograms node_programs(const Program& program, const std::set<std::string>& varying, const std::string& prefix) {
  return with_lowered(program, [&](const Recorder& r, const Program& p) {
    const std::vector<bool>& reachable = p.reachable();
    std::vector<bool> varies(reachable.size());
    std::map<int, std::string> cuts;
    std::vector<std::pair<std::string, int>> passed;
    const auto pass = [&](int id) {
      const Op op = r.node(id).op;
      if (varies[std::size_t(id)] || op == Op::Const || op == Op::Input || cuts.count(id)) return;
      cuts[id] = fmt::format("{}{}", prefix, cuts.size());
      passed.push_back({cuts[id], id});
    };
    for (int id = 0; id < p.size(); ++id) {
      const ExprNode& n = r.node(id);
      if (!reachable[std::size_t(id)]) continue;
      bool any = n.op == Op::Input && varying.count(n.name);
      for (int a : n.args) any = any || varies[std::size_t(a)];
      varies[std::size_t(id)] = any;
      if (any)
        for (int a : n.args) pass(a);
    }
    for (const auto& [name, id] : p.outputs()) pass(id);
    return NodePrograms{Writer(r, {}).write(passed), Writer(r, cuts).write(p.outputs())};
  });
}

}  // namespace brdfc::print
