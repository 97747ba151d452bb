// SPDX-License-Identifier: GPL-3.0-or-later
// Expr: the scalar type that records a formula.
//
// Operations fold constants in double precision, share equal subexpressions and drop neutral operations. Loops and
// selections are nodes of their own. A comparison of Exprs does not convert to bool, so a formula that branches on data
// does not compile. Errors that only recording can detect (constant folding with a result that is not finite, nested
// loops, mixed recorders) throw ExprError.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "core/scalar.h"
#include "core/vec.h"
#include "tables/table.h"
#include "trace/graph.h"

namespace brdfc {
inline namespace trace {

class Condition;

/// A recorded real number. A literal needs no recorder until it meets a node.
class Expr {
 public:
  Expr() = default;
  Expr(double literal) : literal_(literal) {}  // NOLINT: formulas mix literals and scalars
  /// The input with this name.
  static Expr input(const std::string& name);
  /// The value of a node of the current recorder.
  static Expr of_node(int id);

  /// True if it is a number that is not yet part of a recording.
  bool is_literal() const { return id_ < 0; }
  bool is_literal(double value) const { return id_ < 0 && literal_ == value; }
  double literal() const { return literal_; }
  int id() const;  ///< its node in the current recorder; adds a node for a literal

  friend Expr operator-(const Expr&);
  friend Expr operator+(const Expr&, const Expr&);
  friend Expr operator-(const Expr&, const Expr&);
  friend Expr operator*(const Expr&, const Expr&);
  friend Expr operator/(const Expr&, const Expr&);

 private:
  int id_ = -1;
  double literal_ = 0;
};

/// A recorded comparison. It converts to nothing, in particular not to bool.
class Condition {
 public:
  explicit Condition(bool literal) : literal_(literal) {}
  static Condition of_node(int id);
  operator bool() const = delete;  // no if, no ?: on data; write select(condition, a, b)
  bool is_literal() const { return id_ < 0; }
  bool literal() const { return literal_; }
  int id() const;

 private:
  int id_ = -1;
  bool literal_ = false;
};

Condition operator<(const Expr&, const Expr&);
Condition operator<=(const Expr&, const Expr&);
Condition operator>(const Expr&, const Expr&);
Condition operator>=(const Expr&, const Expr&);
Condition operator&&(const Condition&, const Condition&);
Condition operator||(const Condition&, const Condition&);
Condition operator!(const Condition&);

Expr sqrt(const Expr&);
Expr cbrt(const Expr&);
Expr exp(const Expr&);
Expr log(const Expr&);
Expr log1p(const Expr&);
Expr expm1(const Expr&);
Expr sin(const Expr&);
Expr cos(const Expr&);
Expr atan(const Expr&);
Expr abs(const Expr&);
Expr pow(const Expr& base, const Expr& exponent);
Expr minimum(const Expr&, const Expr&);
Expr maximum(const Expr&, const Expr&);
Expr select(const Condition&, const Expr&, const Expr&);
/// The same value, with a name for its variable in a printed program.
Expr named(const char* name, const Expr&);

}  // namespace trace

template <> inline int newton_steps<Expr>() {
  return Recorder::current().precision() == Precision::Single ? newton_steps<float>() : newton_steps<double>();
}

/// A recorded colour. It is a single node, so that the printed text computes with colours as the paper does.
template <> struct Rgb<Expr> {
  Rgb() = default;
  Rgb(const Expr& r, const Expr& g, const Expr& b);
  explicit Rgb(const Expr& grey);
  static Rgb input(const std::string& name);
  static Rgb of_node(int id);
  /// True if it is known while recording; then it is written to `value`, unless that is null.
  bool is_constant(std::array<double, 3>* value = nullptr) const;
  int id() const;

 private:
  int id_ = -1;  ///< -1: literal
  std::array<double, 3> literal_{};
};

inline namespace trace {

Rgb<Expr> operator+(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> operator-(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> operator*(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> operator*(const Rgb<Expr>&, const Expr&);
Rgb<Expr> operator*(const Expr&, const Rgb<Expr>&);
Rgb<Expr> operator/(const Rgb<Expr>&, const Expr&);
Rgb<Expr> operator/(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr>& operator+=(Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> select(const Condition&, const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> sqrt(const Rgb<Expr>&);
Rgb<Expr> exp(const Rgb<Expr>&);
Rgb<Expr> log(const Rgb<Expr>&);
Expr max_component(const Rgb<Expr>&);
Rgb<Expr> named(const char* name, const Rgb<Expr>&);

/// The inputs name_x, name_y and name_z.
inline Vec3<Expr> input3(const std::string& name) {
  return {Expr::input(name + "_x"), Expr::input(name + "_y"), Expr::input(name + "_z")};
}

// Used by the templates below; formulas call those.
Expr record_lookup(const std::shared_ptr<const Table>&, const std::vector<Expr>& coordinates);
std::vector<Expr> loop_variables(int count, int serial);
std::vector<Expr> close_loop(int count, int serial, const std::vector<Expr>& init, const std::vector<Expr>& next);

/// Records a table look-up: an array and a function call in OSL.
template <std::size_t D> Expr lookup(const std::shared_ptr<const Table>& table, const std::array<Expr, D>& x) {
  static_assert(D >= 1 && D <= 4);
  return record_lookup(table, {x.begin(), x.end()});
}
inline Expr lookup(const std::shared_ptr<const Table>& table, const std::vector<Expr>& x) {
  return record_lookup(table, x);
}

/// Records a loop, which is not unrolled. Loops can't be nested.
template <std::size_t N, class Step>
std::array<Expr, N> iterate(int count, const std::array<Expr, N>& state, Step step) {
  Recorder& recorder = Recorder::current();
  const int serial = recorder.open_loop();
  const std::vector<Expr> vars = loop_variables(int(N), serial);
  std::array<Expr, N> in;
  std::copy(vars.begin(), vars.end(), in.begin());
  const std::array<Expr, N> next = step(in);
  recorder.close_loop();
  const std::vector<Expr> out = close_loop(count, serial, {state.begin(), state.end()}, {next.begin(), next.end()});
  std::array<Expr, N> result;
  std::copy(out.begin(), out.end(), result.begin());
  return result;
}

}  // namespace trace
}  // namespace brdfc
