// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/expr.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trace/op.h"

namespace brdfc {
inline namespace trace {
namespace {

using Value = std::array<double, 3>;

Value grey(double v) { return {v, v, v}; }

bool is_const(const ExprNode& n) { return n.op == Op::Const; }
bool is_const(const ExprNode& n, double v) { return is_const(n) && n.value == grey(v); }

Value fold(Op op, const std::vector<int>& args) {
  const Recorder& r = Recorder::current();
  Value result;
  for (std::size_t c = 0; c < 3; ++c) {
    double a[3] = {};
    for (std::size_t i = 0; i < args.size(); ++i) a[i] = r.node(args[i]).value[c];
    result[c] = apply(op, a);
    if (!std::isfinite(result[c]))
      throw ExprError(fmt::format("folding {}({}, {}, {}) gives {}", name_of(op), a[0], a[1], a[2], result[c]));
  }
  return result;
}

int constant(const Value& v, ExprType type) { return Recorder::current().add({Op::Const, type, {}, v, "", 0, -1, ""}); }

ExprType result_type(Op op, const std::vector<int>& args) {
  if (op == Op::Less || op == Op::LessEqual || op == Op::And || op == Op::Or || op == Op::Not) return ExprType::Bool;
  if (op == Op::MaxComponent) return ExprType::Real;
  for (std::size_t i = op == Op::Select ? 1 : 0; i < args.size(); ++i)
    if (Recorder::current().node(args[i]).type == ExprType::Color) return ExprType::Color;
  return ExprType::Real;
}

/// Builds an operation after folding constants and dropping neutral elements.
int build(Op op, std::vector<int> args) {
  Recorder& r = Recorder::current();
  const ExprType type = result_type(op, args);
  const bool constants = std::all_of(args.begin(), args.end(), [&](int a) { return is_const(r.node(a)); });
  if (op == Op::MaxComponent) {
    if (constants) {
      const Value& v = r.node(args[0]).value;
      return constant(grey(std::max({v[0], v[1], v[2]})), ExprType::Real);
    }
    if (r.node(args[0]).type == ExprType::Real) return args[0];
  } else if (constants) {
    return constant(fold(op, args), type);
  }
  const auto node = [&](int i) -> const ExprNode& { return r.node(args[std::size_t(i)]); };
  switch (op) {
    case Op::Add:
      if (is_const(node(0), 0) && node(1).type == type) return args[1];
      if (is_const(node(1), 0) && node(0).type == type) return args[0];
      if (node(1).op == Op::Neg) return build(Op::Sub, {args[0], node(1).args[0]});
      break;
    case Op::Sub:
      if (is_const(node(1), 0) && node(0).type == type) return args[0];
      if (is_const(node(0), 0)) return build(Op::Neg, {args[1]});
      if (node(1).op == Op::Neg) return build(Op::Add, {args[0], node(1).args[0]});
      break;
    case Op::Mul:
      // Recording only produces finite factors, so a constant zero removes the product. This eliminates a lobe with
      // weight 0.
      if (is_const(node(0), 0) || is_const(node(1), 0)) return constant(grey(0), type);
      if (is_const(node(0), 1) && node(1).type == type) return args[1];
      if (is_const(node(1), 1) && node(0).type == type) return args[0];
      if (is_const(node(0), -1)) return build(Op::Neg, {args[1]});
      if (is_const(node(1), -1)) return build(Op::Neg, {args[0]});
      break;
    case Op::Div:
      if (is_const(node(0), 0)) return constant(grey(0), type);
      if (is_const(node(1), 1)) return args[0];
      if (is_const(node(1), 0)) throw ExprError("division by a constant zero");
      break;
    case Op::Neg:
      if (node(0).op == Op::Neg) return node(0).args[0];
      break;
    case Op::Select:
      if (is_const(node(0))) return node(0).value[0] != 0 ? args[1] : args[2];
      if (args[1] == args[2]) return args[1];
      break;
    case Op::And:
      if (is_const(node(0))) return node(0).value[0] != 0 ? args[1] : args[0];
      if (is_const(node(1))) return node(1).value[0] != 0 ? args[0] : args[1];
      break;
    case Op::Or:
      if (is_const(node(0))) return node(0).value[0] != 0 ? args[0] : args[1];
      if (is_const(node(1))) return node(1).value[0] != 0 ? args[1] : args[0];
      break;
    case Op::Min:
    case Op::Max:
      if (args[0] == args[1]) return args[0];
      break;
    default:
      break;
  }
  // a + b and b + a share one node; the order that was recorded first is the one printed.
  if (op == Op::Add || op == Op::Mul) {
    const int swapped = r.find({op, type, {args[1], args[0]}, {}, "", 0, -1, ""});
    if (swapped >= 0) return swapped;
  }
  return r.add({op, type, std::move(args), {}, "", 0, -1, ""});
}

Expr unary(Op op, const Expr& a) {
  if (a.is_literal()) {
    const double v = a.literal(), y = apply(op, &v);
    if (!std::isfinite(y)) throw ExprError(fmt::format("folding {}({}) gives {}", name_of(op), v, y));
    return Expr(y);
  }
  return Expr::of_node(build(op, {a.id()}));
}

Expr binary(Op op, const Expr& a, const Expr& b) {
  if (a.is_literal() && b.is_literal()) {
    const double v[2] = {a.literal(), b.literal()}, y = apply(op, v);
    if (!std::isfinite(y)) throw ExprError(fmt::format("folding {}({}, {}) gives {}", name_of(op), v[0], v[1], y));
    return Expr(y);
  }
  return Expr::of_node(build(op, {a.id(), b.id()}));
}

Condition compare(Op op, const Expr& a, const Expr& b) {
  if (a.is_literal() && b.is_literal()) {
    const double v[2] = {a.literal(), b.literal()};
    return Condition(apply(op, v) != 0);
  }
  return Condition::of_node(build(op, {a.id(), b.id()}));
}

Rgb<Expr> color_binary(Op op, int a, int b) { return Rgb<Expr>::of_node(build(op, {a, b})); }

}  // namespace

Expr Expr::input(const std::string& name) {
  return of_node(Recorder::current().add({Op::Input, ExprType::Real, {}, {}, name, 0, -1, ""}));
}
Expr Expr::of_node(int id) {
  Expr e;
  const ExprNode& n = Recorder::current().node(id);
  if (is_const(n))
    e.literal_ = n.value[0];
  else
    e.id_ = id;
  return e;
}
int Expr::id() const { return id_ >= 0 ? id_ : constant(grey(literal_), ExprType::Real); }

Condition Condition::of_node(int id) {
  const ExprNode& n = Recorder::current().node(id);
  Condition c(is_const(n) && n.value[0] != 0);
  if (!is_const(n)) c.id_ = id;
  return c;
}
int Condition::id() const { return id_ >= 0 ? id_ : constant(grey(literal_), ExprType::Bool); }

Expr operator-(const Expr& a) { return unary(Op::Neg, a); }
Expr operator+(const Expr& a, const Expr& b) { return binary(Op::Add, a, b); }
Expr operator-(const Expr& a, const Expr& b) { return binary(Op::Sub, a, b); }
Expr operator*(const Expr& a, const Expr& b) { return binary(Op::Mul, a, b); }
Expr operator/(const Expr& a, const Expr& b) { return binary(Op::Div, a, b); }
Condition operator<(const Expr& a, const Expr& b) { return compare(Op::Less, a, b); }
Condition operator<=(const Expr& a, const Expr& b) { return compare(Op::LessEqual, a, b); }
Condition operator>(const Expr& a, const Expr& b) { return compare(Op::Less, b, a); }
Condition operator>=(const Expr& a, const Expr& b) { return compare(Op::LessEqual, b, a); }
Condition operator&&(const Condition& a, const Condition& b) {
  return Condition::of_node(build(Op::And, {a.id(), b.id()}));
}
Condition operator||(const Condition& a, const Condition& b) {
  return Condition::of_node(build(Op::Or, {a.id(), b.id()}));
}
Condition operator!(const Condition& a) {
  return a.is_literal() ? Condition(!a.literal()) : Condition::of_node(build(Op::Not, {a.id()}));
}

Expr sqrt(const Expr& a) { return unary(Op::Sqrt, a); }
Expr cbrt(const Expr& a) { return unary(Op::Cbrt, a); }
Expr exp(const Expr& a) { return unary(Op::Exp, a); }
Expr log(const Expr& a) { return unary(Op::Log, a); }
Expr log1p(const Expr& a) { return unary(Op::Log1p, a); }
Expr expm1(const Expr& a) { return unary(Op::Expm1, a); }
Expr sin(const Expr& a) { return unary(Op::Sin, a); }
Expr cos(const Expr& a) { return unary(Op::Cos, a); }
Expr atan(const Expr& a) { return unary(Op::Atan, a); }
Expr abs(const Expr& a) { return unary(Op::Abs, a); }
Expr pow(const Expr& a, const Expr& b) { return binary(Op::Pow, a, b); }
Expr minimum(const Expr& a, const Expr& b) { return binary(Op::Min, a, b); }
Expr maximum(const Expr& a, const Expr& b) { return binary(Op::Max, a, b); }

Expr select(const Condition& c, const Expr& a, const Expr& b) {
  if (c.is_literal()) return c.literal() ? a : b;
  return Expr::of_node(build(Op::Select, {c.id(), a.id(), b.id()}));
}

Expr named(const char* name, const Expr& e) {
  if (!e.is_literal()) Recorder::current().hint(e.id(), name);
  return e;
}

Rgb<Expr> operator+(const Rgb<Expr>& a, const Rgb<Expr>& b) { return color_binary(Op::Add, a.id(), b.id()); }
Rgb<Expr> operator-(const Rgb<Expr>& a, const Rgb<Expr>& b) { return color_binary(Op::Sub, a.id(), b.id()); }
Rgb<Expr> operator*(const Rgb<Expr>& a, const Rgb<Expr>& b) { return color_binary(Op::Mul, a.id(), b.id()); }
Rgb<Expr> operator*(const Rgb<Expr>& a, const Expr& s) { return color_binary(Op::Mul, a.id(), s.id()); }
Rgb<Expr> operator*(const Expr& s, const Rgb<Expr>& a) { return a * s; }
Rgb<Expr> operator/(const Rgb<Expr>& a, const Expr& s) { return color_binary(Op::Div, a.id(), s.id()); }
Rgb<Expr> operator/(const Rgb<Expr>& a, const Rgb<Expr>& b) { return color_binary(Op::Div, a.id(), b.id()); }
Rgb<Expr>& operator+=(Rgb<Expr>& a, const Rgb<Expr>& b) { return a = a + b; }
Rgb<Expr> select(const Condition& c, const Rgb<Expr>& a, const Rgb<Expr>& b) {
  if (c.is_literal()) return c.literal() ? a : b;
  return Rgb<Expr>::of_node(build(Op::Select, {c.id(), a.id(), b.id()}));
}
Rgb<Expr> sqrt(const Rgb<Expr>& c) { return Rgb<Expr>::of_node(build(Op::Sqrt, {c.id()})); }
Rgb<Expr> exp(const Rgb<Expr>& c) { return Rgb<Expr>::of_node(build(Op::Exp, {c.id()})); }
Rgb<Expr> log(const Rgb<Expr>& c) { return Rgb<Expr>::of_node(build(Op::Log, {c.id()})); }
Expr max_component(const Rgb<Expr>& c) { return Expr::of_node(build(Op::MaxComponent, {c.id()})); }
Rgb<Expr> named(const char* name, const Rgb<Expr>& c) {
  if (!c.is_constant()) Recorder::current().hint(c.id(), name);
  return c;
}

Expr record_lookup(const std::shared_ptr<const Table>& table, const std::vector<Expr>& coordinates) {
  if (coordinates.size() != table->axes.size())
    throw ExprError("table " + table->name + ": wrong number of coordinates");
  require_lookup(*table, coordinates.size());
  ExprNode node{Op::Lookup, ExprType::Real, {}, {}, table->name, 0, -1, "", table};
  for (const Expr& x : coordinates) node.args.push_back(x.id());
  const int id = Recorder::current().add(std::move(node));
  if (Recorder::current().node(id).table != table) throw ExprError("two tables are named " + table->name);
  return Expr::of_node(id);
}

std::vector<Expr> loop_variables(int count, int serial) {
  std::vector<Expr> vars;
  for (int i = 0; i < count; ++i)
    vars.push_back(Expr::of_node(Recorder::current().add({Op::LoopVar, ExprType::Real, {}, {}, "", i, serial, ""})));
  return vars;
}

std::vector<Expr> close_loop(int count, int serial, const std::vector<Expr>& init, const std::vector<Expr>& next) {
  Recorder& r = Recorder::current();
  std::vector<int> args;
  for (const Expr& e : init) args.push_back(e.id());
  for (const Expr& e : next) args.push_back(e.id());
  // The loop's serial is stored in `value`, so that two loops with equal bodies do not share a node.
  const int loop = r.add({Op::Loop, ExprType::Real, std::move(args), {double(serial), 0, 0}, "", count, -1, ""});
  std::vector<Expr> out;
  for (std::size_t i = 0; i < init.size(); ++i)
    out.push_back(Expr::of_node(r.add({Op::LoopOut, ExprType::Real, {loop}, {}, "", int(i), -1, ""})));
  return out;
}

}  // namespace trace

// Specialisation of a template in core.

Rgb<Expr>::Rgb(const Expr& r, const Expr& g, const Expr& b) {
  if (r.is_literal() && g.is_literal() && b.is_literal())
    literal_ = {r.literal(), g.literal(), b.literal()};
  else
    id_ = Recorder::current().add({Op::MakeColor, ExprType::Color, {r.id(), g.id(), b.id()}, {}, "", 0, -1, ""});
}
Rgb<Expr>::Rgb(const Expr& v) {
  if (v.is_literal())
    literal_ = grey(v.literal());
  else
    id_ = v.id();
}
Rgb<Expr> Rgb<Expr>::input(const std::string& name) {
  return of_node(Recorder::current().add({Op::Input, ExprType::Color, {}, {}, name, 0, -1, ""}));
}
Rgb<Expr> Rgb<Expr>::of_node(int id) {
  Rgb c;
  const ExprNode& n = Recorder::current().node(id);
  if (is_const(n))
    c.literal_ = n.value;
  else
    c.id_ = id;
  return c;
}
bool Rgb<Expr>::is_constant(std::array<double, 3>* value) const {
  if (id_ < 0 && value) *value = literal_;
  return id_ < 0;
}
int Rgb<Expr>::id() const {
  if (id_ >= 0) return id_;
  return constant(literal_, literal_ == grey(literal_[0]) ? ExprType::Real : ExprType::Color);
}

}  // namespace brdfc
