// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/expr.h"

#include <algorithm>
#include <cctype>
#include <set>
#include <tuple>

#include "core/osl_arithmetic.h"
#include "core/osl_words.h"
#include "core/table.h"

namespace brdfc {
namespace {

thread_local Recorder* current_recorder = nullptr;

using Value = std::array<double, 3>;

Value grey(double v) { return {v, v, v}; }

/// One operation on numbers: the meaning of the graph, used for folding (double) and by Program::run.
template <class T> T apply(Op op, const T* a) {
  using std::max;
  using std::min;
  switch (op) {
    case Op::Add:
      return a[0] + a[1];
    case Op::Sub:
      return a[0] - a[1];
    case Op::Mul:
      return a[0] * a[1];
    case Op::Div:
      return a[0] / a[1];
    case Op::Neg:
      return -a[0];
    case Op::Sqrt:
      return std::sqrt(a[0]);
    case Op::Cbrt:
      return std::cbrt(a[0]);
    case Op::Exp:
      return std::exp(a[0]);
    case Op::Log:
      return std::log(a[0]);
    case Op::Log1p:
      return std::log1p(a[0]);
    case Op::Expm1:
      return std::expm1(a[0]);
    case Op::Sin:
      return std::sin(a[0]);
    case Op::Cos:
      return std::cos(a[0]);
    case Op::Atan:
      return std::atan(a[0]);
    case Op::Pow:
      return std::pow(a[0], a[1]);
    case Op::Abs:
      return std::abs(a[0]);
    case Op::Min:
      return minimum(a[0], a[1]);
    case Op::Max:
      return maximum(a[0], a[1]);
    case Op::Less:
      return T(a[0] < a[1]);
    case Op::LessEqual:
      return T(a[0] <= a[1]);
    case Op::And:
      return T(a[0] != T(0) && a[1] != T(0));
    case Op::Or:
      return T(a[0] != T(0) || a[1] != T(0));
    case Op::Not:
      return T(a[0] == T(0));
    case Op::Select:
      return a[0] != T(0) ? a[1] : a[2];
    default:
      throw ExprError("operation without a value");
  }
}

/// The same as OSL computes it.
float apply_osl(Op op, const float* a) {
  switch (op) {
    case Op::Div:
      return osl::divide(a[0], a[1]);
    case Op::Sqrt:
      return osl::sqrt(a[0]);
    case Op::Cbrt:
      return osl::cbrt(a[0]);
    case Op::Exp:
      return osl::exp(a[0]);
    case Op::Log:
      return osl::log(a[0]);
    case Op::Log1p:
      return osl::log1p(a[0]);
    case Op::Expm1:
      return osl::expm1(a[0]);
    case Op::Sin:
      return osl::sin(a[0]);
    case Op::Cos:
      return osl::cos(a[0]);
    case Op::Atan:
      return osl::atan(a[0]);
    case Op::Pow:
      return osl::pow(a[0], a[1]);
    default:
      return apply(op, a);
  }
}

template <class T> T execute(Op op, const T* a) {
  if constexpr (std::is_same_v<T, float>)
    if (OslArithmetic::active()) return apply_osl(op, a);
  return apply(op, a);
}

const char* op_name(Op op) {
  static const char* const names[] = {
      "constant",    "input",  "+",     "-",   "*",   "/",      "negation",      "sqrt",  "cbrt", "exp",
      "log",         "log1p",  "expm1", "sin", "cos", "atan",   "pow",           "abs",   "min",  "max",
      "<",           "<=",     "and",   "or",  "not", "select", "max_component", "color", "loop", "loop variable",
      "loop result", "look-up"};
  return names[int(op)];
}

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
      throw ExprError(fmt::format("folding {}({}, {}, {}) gives {}", op_name(op), a[0], a[1], a[2], result[c]));
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
      // The factor is finite by construction, so a zero removes it: this is what prunes a lobe.
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
  // Equal operations share one node whichever way round they were written; the first way is the one printed.
  if (op == Op::Add || op == Op::Mul) {
    const int swapped = r.find({op, type, {args[1], args[0]}, {}, "", 0, -1, ""});
    if (swapped >= 0) return swapped;
  }
  return r.add({op, type, std::move(args), {}, "", 0, -1, ""});
}

Expr unary(Op op, const Expr& a) {
  if (a.is_literal()) {
    const double v = a.literal(), y = apply(op, &v);
    if (!std::isfinite(y)) throw ExprError(fmt::format("folding {}({}) gives {}", op_name(op), v, y));
    return Expr(y);
  }
  return Expr::of_node(build(op, {a.id()}));
}

Expr binary(Op op, const Expr& a, const Expr& b) {
  if (a.is_literal() && b.is_literal()) {
    const double v[2] = {a.literal(), b.literal()}, y = apply(op, v);
    if (!std::isfinite(y)) throw ExprError(fmt::format("folding {}({}, {}) gives {}", op_name(op), v[0], v[1], y));
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

Recorder::Recorder() : outer_(current_recorder) { current_recorder = this; }
Recorder::~Recorder() { current_recorder = outer_; }

Recorder& Recorder::current() {
  if (!current_recorder) throw ExprError("an Expr met another without a Recorder");
  return *current_recorder;
}

Recorder::Key Recorder::key_of(const ExprNode& n) { return {n.op, n.type, n.args, n.value, n.name, n.index, n.scope}; }

int Recorder::scope_of(const ExprNode& node) const {
  int scope = node.scope;
  for (int a : node.args) {
    if (a < 0 || a >= size()) throw ExprError("an Expr of another Recorder");
    if (node.op != Op::Loop) scope = std::max(scope, nodes_[std::size_t(a)].scope);
  }
  return scope;
}

int Recorder::find(const ExprNode& node) const {
  ExprNode scoped = node;
  scoped.scope = scope_of(node);
  const auto it = interned_.find(key_of(scoped));
  return it == interned_.end() ? -1 : it->second;
}

int Recorder::add(ExprNode node) {
  node.scope = scope_of(node);
  const auto [it, inserted] = interned_.emplace(key_of(node), size());
  if (inserted) nodes_.push_back(std::move(node));
  return it->second;
}

void Recorder::hint(int id, const char* name) {
  ExprNode& n = nodes_[std::size_t(id)];
  if (n.hint.empty() && n.op != Op::Const && n.op != Op::Input) n.hint = name;
}

int Recorder::open_loop() {
  if (in_loop_) throw ExprError("a loop inside a loop cannot be recorded");
  in_loop_ = true;
  return loops_++;
}
void Recorder::close_loop() { in_loop_ = false; }

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
Expr max_component(const Rgb<Expr>& c) { return Expr::of_node(build(Op::MaxComponent, {c.id()})); }
Rgb<Expr> named(const char* name, const Rgb<Expr>& c) {
  if (!c.is_constant()) Recorder::current().hint(c.id(), name);
  return c;
}

namespace detail {

Expr record_lookup(const std::shared_ptr<const Table>& table, const std::vector<Expr>& coordinates) {
  if (coordinates.size() != table->sizes.size())
    throw ExprError("table " + table->name + ": wrong number of coordinates");
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
  // The serial rides in `value`, so that two loops with the same body stay apart in the table of nodes.
  const int loop = r.add({Op::Loop, ExprType::Real, std::move(args), {double(serial), 0, 0}, "", count, -1, ""});
  std::vector<Expr> out;
  for (std::size_t i = 0; i < init.size(); ++i)
    out.push_back(Expr::of_node(r.add({Op::LoopOut, ExprType::Real, {loop}, {}, "", int(i), -1, ""})));
  return out;
}

}  // namespace detail

const std::vector<bool>& Program::reachable() const {
  const Recorder& r = Recorder::current();
  std::vector<bool>& seen = reachable_;
  // Nodes and outputs are added, never changed.
  if (seen.size() == std::size_t(r.size()) && outputs_seen_ == outputs_.size()) return seen;
  seen.assign(std::size_t(r.size()), false);
  outputs_seen_ = outputs_.size();
  std::vector<int> stack;
  for (const auto& [name, id] : outputs_) stack.push_back(id);
  while (!stack.empty()) {
    const int id = stack.back();
    stack.pop_back();
    if (seen[std::size_t(id)]) continue;
    seen[std::size_t(id)] = true;
    for (int a : r.node(id).args) stack.push_back(a);
  }
  return seen;
}

int Program::operations() const {
  const std::vector<bool>& seen = reachable();
  int count = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Op op = Recorder::current().node(int(i)).op;
    if (seen[i] && op != Op::Const && op != Op::Input && op != Op::LoopVar && op != Op::LoopOut) ++count;
  }
  return count;
}

std::vector<std::string> Program::inputs() const {
  const std::vector<bool>& seen = reachable();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] && Recorder::current().node(int(i)).op == Op::Input)
      names.push_back(Recorder::current().node(int(i)).name);
  return names;
}

template <class T>
std::map<std::string, std::array<T, 3>> Program::run(const std::map<std::string, std::array<T, 3>>& inputs) const {
  const Recorder& r = Recorder::current();
  const std::vector<bool>& seen = reachable();
  std::vector<std::array<T, 3>> value(std::size_t(r.size()));
  const auto compute = [&](int id) {
    const ExprNode& n = r.node(id);
    std::array<T, 3>& out = value[std::size_t(id)];
    const auto arg = [&](std::size_t i) -> const std::array<T, 3>& { return value[std::size_t(n.args[i])]; };
    switch (n.op) {
      case Op::Const:
        out = {T(n.value[0]), T(n.value[1]), T(n.value[2])};
        break;
      case Op::Input: {
        const auto it = inputs.find(n.name);
        if (it == inputs.end()) throw ExprError("no value for input " + n.name);
        out = it->second;
        break;
      }
      case Op::MaxComponent:
        out.fill(std::max({arg(0)[0], arg(0)[1], arg(0)[2]}));
        break;
      case Op::MakeColor:
        out = {arg(0)[0], arg(1)[0], arg(2)[0]};
        break;
      case Op::Lookup:
        switch (n.args.size()) {
          case 1:
            out.fill(lookup<T, 1>(n.table, {arg(0)[0]}));
            break;
          case 2:
            out.fill(lookup<T, 2>(n.table, {arg(0)[0], arg(1)[0]}));
            break;
          case 3:
            out.fill(lookup<T, 3>(n.table, {arg(0)[0], arg(1)[0], arg(2)[0]}));
            break;
          default:
            out.fill(lookup<T, 4>(n.table, {arg(0)[0], arg(1)[0], arg(2)[0], arg(3)[0]}));
        }
        break;
      case Op::LoopVar:
        break;  // set by the loop
      case Op::LoopOut:
        out = value[std::size_t(r.node(n.args[0]).args[std::size_t(n.index)])];
        break;
      default:
        for (std::size_t c = 0; c < 3; ++c) {
          // A real is grey.
          if (c > 0 && n.type != ExprType::Color) {
            out[c] = out[0];
            continue;
          }
          T a[3] = {};
          for (std::size_t i = 0; i < n.args.size(); ++i) a[i] = arg(i)[c];
          out[c] = execute(n.op, a);
        }
    }
  };
  std::map<int, std::vector<std::array<T, 3>>> loop_results;
  for (int id = 0; id < r.size(); ++id) {
    const ExprNode& n = r.node(id);
    if (!seen[std::size_t(id)] || n.scope >= 0) continue;
    if (n.op == Op::LoopOut) {
      value[std::size_t(id)] = loop_results.at(n.args[0])[std::size_t(n.index)];
      continue;
    }
    if (n.op != Op::Loop) {
      compute(id);
      continue;
    }
    const std::size_t size = n.args.size() / 2;
    const int serial = int(n.value[0]);
    std::vector<std::array<T, 3>> state;
    for (std::size_t k = 0; k < size; ++k) state.push_back(value[std::size_t(n.args[k])]);
    for (int i = 0; i < n.index; ++i) {
      for (int body = 0; body < id; ++body) {
        const ExprNode& b = r.node(body);
        if (b.scope != serial || !seen[std::size_t(body)]) continue;
        if (b.op == Op::LoopVar)
          value[std::size_t(body)] = state[std::size_t(b.index)];
        else
          compute(body);
      }
      for (std::size_t k = 0; k < size; ++k) state[k] = value[std::size_t(n.args[size + k])];
    }
    loop_results[id] = std::move(state);
  }
  std::map<std::string, std::array<T, 3>> result;
  for (const auto& [name, id] : outputs_) result[name] = value[std::size_t(id)];
  return result;
}
template std::map<std::string, std::array<float, 3>> Program::run(
    const std::map<std::string, std::array<float, 3>>&) const;
template std::map<std::string, std::array<double, 3>> Program::run(
    const std::map<std::string, std::array<double, 3>>&) const;

namespace {

/// Where OSL's spelling lives: text of a subexpression and how tightly it binds.
class OslPrinter {
 public:
  OslPrinter(const std::vector<bool>& reachable, const std::vector<std::string>& taken)
      : r_(Recorder::current()), reachable_(reachable), taken_(taken.begin(), taken.end()) {
    uses_.assign(reachable.size(), 0);
    for (std::size_t i = 0; i < reachable.size(); ++i)
      if (reachable[i])
        for (int a : r_.node(int(i)).args) ++uses_[std::size_t(a)];
  }

  /// The arrays that look-ups read, before all statements.
  std::vector<std::string> arrays(int indent) {
    std::vector<std::string> all;
    for (std::size_t i = 0; i < reachable_.size(); ++i) {
      const ExprNode& n = r_.node(int(i));
      if (!reachable_[i] || n.op != Op::Lookup || array_names_.count(n.name)) continue;
      const std::string name = fresh(n.name);
      array_names_[n.name] = name;
      // Tables are most of a long shader's text: without what is not needed to read it.
      std::string out = fmt::format("{:{}}float {}[{}] = {{", "", indent, name, n.table->values.size());
      for (std::size_t k = 0; k < n.table->values.size(); ++k) {
        std::string value = number(n.table->values[k]);
        if (value.starts_with("0.") && value != "0.0") value.erase(0, 1);
        out += (k == 0 ? "" : k % 16 == 0 ? ",\n" : ",") + value;
      }
      all.push_back(out + "};\n");
    }
    return all;
  }

  void count_output(int id) { ++uses_[std::size_t(id)]; }

  /// Statements of one scope (-1: outside every loop).
  void statements(int scope, int limit, int indent, std::string& out) {
    for (int id = 0; id < limit; ++id) {
      const ExprNode& n = r_.node(id);
      if (!reachable_[std::size_t(id)] || n.scope != scope) continue;
      if (n.op == Op::Loop)
        loop(id, indent, out);
      else if (wants_variable(id))
        declare(id, indent, out);
    }
  }

  std::string use(int id, int precedence) const {
    const auto it = names_.find(id);
    if (it != names_.end()) return it->second;
    const Text t = text(id);
    return t.precedence < precedence ? "(" + t.s + ")" : t.s;
  }

 private:
  struct Text {
    std::string s;
    int precedence;  // 0 ternary, 1 logic, 2 comparison, 3 sum, 4 product, 5 unary, 6 atom
  };

  static std::string number(double v) {
    const float f = float(v);
    if (!std::isfinite(f)) throw ExprError(fmt::format("{} is not a float", v));
    std::string s = fmt::format("{}", f);
    if (s.find_first_of(".e") == std::string::npos) s += ".0";
    return s;
  }

  static const char* type_name(ExprType t) {
    return t == ExprType::Color ? "color" : t == ExprType::Bool ? "int" : "float";
  }

  bool wants_variable(int id) const {
    const ExprNode& n = r_.node(id);
    switch (n.op) {
      case Op::Const:
      case Op::Input:
      case Op::LoopVar:
      case Op::LoopOut:
        return false;
      default:
        return !n.hint.empty() || uses_[std::size_t(id)] > 1 || text(id).s.size() > 88;
    }
  }

  std::string fresh(const std::string& base) {
    const std::string start = unnumbered(base);
    std::string name = start;
    for (int i = 1; is_osl_word(name) || !taken_.insert(name).second; ++i) name = fmt::format("{}_{}", start, i);
    return name;
  }

  void declare(int id, int indent, std::string& out) {
    const ExprNode& n = r_.node(id);
    const std::string value = text(id).s;
    const std::string name = fresh(n.hint.empty() ? "t" : n.hint);
    out += fmt::format("{:{}}{} {} = {};\n", "", indent, type_name(n.type), name, value);
    names_[id] = name;
  }

  void loop(int id, int indent, std::string& out) {
    const ExprNode& n = r_.node(id);
    const std::size_t size = n.args.size() / 2;
    const int serial = int(n.value[0]);
    std::vector<std::string> vars;
    for (std::size_t k = 0; k < size; ++k) {
      vars.push_back(fresh(fmt::format("x{}", k)));
      out += fmt::format("{:{}}float {} = {};\n", "", indent, vars[k], use(n.args[k], 0));
    }
    for (int v = 0; v < id; ++v)
      if (r_.node(v).op == Op::LoopVar && r_.node(v).scope == serial) names_[v] = vars[std::size_t(r_.node(v).index)];
    const std::string counter = fresh("i");
    out += fmt::format("{:{}}for (int {} = 0; {} < {}; {}++) {{\n", "", indent, counter, counter, n.index, counter);
    statements(serial, id, indent + 4, out);
    // All of the next state before any of it is assigned: one element may use another's old value.
    std::vector<std::string> next;
    for (std::size_t k = 0; k < size; ++k) {
      next.push_back(fresh(fmt::format("next{}", k)));
      out += fmt::format("{:{}}float {} = {};\n", "", indent + 4, next[k], use(n.args[size + k], 0));
    }
    for (std::size_t k = 0; k < size; ++k) out += fmt::format("{:{}}{} = {};\n", "", indent + 4, vars[k], next[k]);
    out += fmt::format("{:{}}}}\n", "", indent);
    loop_vars_[id] = std::move(vars);
  }

  Text call(const char* function, const ExprNode& n) const {
    std::string s = std::string(function) + "(";
    for (std::size_t i = 0; i < n.args.size(); ++i) s += (i ? ", " : "") + use(n.args[i], 0);
    return {s + ")", 6};
  }

  Text infix(const char* op, const ExprNode& n, int precedence) const {
    // Left-associative, as C and OSL read it; the grouping of floating-point operations must survive.
    return {use(n.args[0], precedence) + " " + op + " " + use(n.args[1], precedence + 1), precedence};
  }

  Text text(int id) const {
    const ExprNode& n = r_.node(id);
    switch (n.op) {
      case Op::Const:
        if (n.type == ExprType::Bool) return {n.value[0] != 0 ? "1" : "0", 6};
        if (n.type == ExprType::Color)
          return {fmt::format("color({}, {}, {})", number(n.value[0]), number(n.value[1]), number(n.value[2])), 6};
        return {number(n.value[0]), n.value[0] < 0 ? 5 : 6};
      case Op::Input:
        return {n.name, 6};
      case Op::Add:
        return infix("+", n, 3);
      case Op::Sub:
        return infix("-", n, 3);
      case Op::Mul:
        return infix("*", n, 4);
      case Op::Div:
        return infix("/", n, 4);
      case Op::Neg:
        return {"-" + use(n.args[0], 6), 5};
      case Op::Sqrt:
        return call("sqrt", n);
      case Op::Cbrt:
        return call("cbrt", n);
      case Op::Exp:
        return call("exp", n);
      case Op::Log:
        return call("log", n);
      case Op::Log1p:
        return call("brdfc_log1p", n);
      case Op::Expm1:
        return call("brdfc_expm1", n);
      case Op::Sin:
        return call("sin", n);
      case Op::Cos:
        return call("cos", n);
      case Op::Atan:
        return call("atan", n);
      case Op::Pow:
        return call("pow", n);
      case Op::Abs:
        return call("abs", n);
      case Op::Min:
        return call("min", n);
      case Op::Max:
        return call("max", n);
      case Op::Less:
        return infix("<", n, 2);
      case Op::LessEqual:
        return infix("<=", n, 2);
      case Op::And:
        return {use(n.args[0], 2) + " && " + use(n.args[1], 2), 1};
      case Op::Or:
        return {use(n.args[0], 2) + " || " + use(n.args[1], 2), 1};
      case Op::Not:
        return {"!" + use(n.args[0], 6), 5};
      case Op::Select: {
        // Both arms of an OSL conditional must have one type.
        const auto arm = [&](std::size_t i) {
          const bool promote = n.type == ExprType::Color && r_.node(n.args[i]).type != ExprType::Color;
          return promote ? "color(" + use(n.args[i], 0) + ")" : use(n.args[i], 1);
        };
        return {use(n.args[0], 1) + " ? " + arm(1) + " : " + arm(2), 0};
      }
      case Op::MaxComponent:
        return call("brdfc_max_component", n);
      case Op::MakeColor:
        return call("color", n);
      case Op::Lookup: {
        std::string text = fmt::format("brdfc_table{}({}", n.args.size(), array_names_.at(n.name));
        for (int size : n.table->sizes) text += fmt::format(", {}", size);
        for (std::size_t i = 0; i < n.args.size(); ++i)
          text += fmt::format(", {} * clamp({}, 0.0, 1.0)", number(n.table->sizes[i] - 1), use(n.args[i], 0));
        return {text + ")", 6};
      }
      case Op::LoopOut:
        return {loop_vars_.at(n.args[0])[std::size_t(n.index)], 6};
      default:
        throw ExprError(std::string("no OSL for ") + op_name(n.op));
    }
  }

  const Recorder& r_;
  const std::vector<bool>& reachable_;
  std::set<std::string> taken_;
  std::vector<int> uses_;
  std::map<int, std::string> names_;
  std::map<int, std::vector<std::string>> loop_vars_;
  std::map<std::string, std::string> array_names_;
};

}  // namespace

std::string Program::print_osl(int indent, const std::vector<std::string>& taken,
                               std::vector<std::string>* arrays) const {
  const std::vector<bool>& seen = reachable();
  std::vector<std::string> reserved = taken;
  for (const std::string& name : inputs()) reserved.push_back(name);
  for (const auto& [name, id] : outputs_) reserved.push_back(name);
  OslPrinter printer(seen, reserved);
  for (const auto& [name, id] : outputs_) printer.count_output(id);
  std::string out;
  for (const std::string& array : printer.arrays(arrays ? 4 : indent)) {
    if (arrays)
      arrays->push_back(array);
    else
      out += array;
  }
  printer.statements(-1, Recorder::current().size(), indent, out);
  for (const auto& [name, id] : outputs_) out += fmt::format("{:{}}{} = {};\n", "", indent, name, printer.use(id, 0));
  return out;
}

}  // namespace brdfc
