// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/node_lowering.h"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "core/series.h"
#include "print/node_table.h"

namespace brdfc::print {
namespace {

/// A value of the lowered program.
struct NodeValue {
  ExprType type = ExprType::Real;
  Expr real{};
  Rgb<Expr> color{};
  Condition flag{false};

  NodeValue() = default;
  NodeValue(const Expr& x) : real(x) {}                               // NOLINT: one of three types
  NodeValue(const Rgb<Expr>& c) : type(ExprType::Color), color(c) {}  // NOLINT
  NodeValue(const Condition& c) : type(ExprType::Bool), flag(c) {}    // NOLINT
  Rgb<Expr> as_color() const { return type == ExprType::Color ? color : Rgb<Expr>(real); }
};

/// Records a program again with only the operations that nodes have.
class Lowering {
 public:
  /// Uses the current recorder.
  explicit Lowering(const Program& program) : p_(program), values_(std::size_t(program.size())) {
    for (int id = 0; id < p_.size(); ++id)
      if (p_.reachable()[std::size_t(id)] && p_.node(id).scope < 0) step(id);
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
    const ExprNode& n = p_.node(id);
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
        const ExprNode& b = p_.node(body);
        if (b.scope != serial || !p_.reachable()[std::size_t(body)]) continue;
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
        if (color) return sqrt(arg(n, 0).color);
        return sqrt(real(0));
      case Op::Cbrt:
        return select(real(0) < Expr(0.0), Expr(-1.0), Expr(1.0)) * pow(abs(real(0)), Expr(1 / 3.));
      case Op::Exp:
        if (color) return exp(arg(n, 0).color);
        return exp(real(0));
      case Op::Log:
        if (color) return log(arg(n, 0).color);
        return log(real(0));
      case Op::Log1p:
        if (is_random(n.args[0])) return log(Expr(1.0) + real(0));
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
        if (const auto polynomial = polynomial_of(*n.table)) return polynomial_at(*polynomial, real(0));
        std::vector<Expr> at;
        for (std::size_t i = 0; i < n.args.size(); ++i) at.push_back(real(i));
        return record_lookup(n.table, at);
      }
      default:
        throw ExprError(std::string("no node for ") + name_of(n.op));
    }
  }

  /// True if a value is made only of random numbers. It has only the precision of these, so a series would gain
  /// nothing.
  bool is_random(int id) const {
    const ExprNode& n = p_.node(id);
    if (n.op == Op::Input) return n.name == "u_0" || n.name == "u_1" || n.name == "u_2";
    const bool plain = n.op == Op::Neg || n.op == Op::Add || n.op == Op::Sub || n.op == Op::Mul;
    return n.op == Op::Const || (plain && std::ranges::all_of(n.args, [&](int a) { return is_random(a); }));
  }

  const Program& p_;
  std::vector<NodeValue> values_;
  std::map<int, std::vector<NodeValue>> loops_;
  Program out_;
};

}  // namespace

Program lowered_to_nodes(const Program& program) {
  Recorder recorder(Recorder::current().precision());
  return Lowering(program).program();
}

}  // namespace brdfc::print
