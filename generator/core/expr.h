// SPDX-License-Identifier: GPL-3.0-or-later
// Expr: the scalar that records a formula, and the program the recording becomes.
//
// A Recorder owns a graph of nodes. Operations on Expr fold constants in double precision, share equal
// subexpressions and drop neutral operations; print_osl() emits only what the outputs reach. Loops and
// selections are nodes of their own. A comparison of Exprs is no bool, so a formula that branches on data
// does not compile; what is met only while recording (a fold that is not finite, a nested loop, mixing
// recorders) throws ExprError. Wrong text is never printed.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/scalar.h"
#include "core/vec.h"

namespace brdfc {

struct Table;

/// A formula that a recording cannot express.
struct ExprError : std::logic_error {
  using std::logic_error::logic_error;
};

enum class Op : std::uint8_t {
  Const,
  Input,
  Add,
  Sub,
  Mul,
  Div,
  Neg,
  Sqrt,
  Cbrt,
  Exp,
  Log,
  Log1p,
  Expm1,
  Sin,
  Cos,
  Atan,
  Pow,
  Abs,
  Min,
  Max,
  Less,
  LessEqual,
  And,
  Or,
  Not,
  Select,
  MaxComponent,
  MakeColor,
  Loop,
  LoopVar,
  LoopOut,
  Lookup
};

enum class ExprType : std::uint8_t { Real, Color, Bool };

struct ExprNode {
  Op op;
  ExprType type;
  std::vector<int> args;                 ///< Loop: N initial values, then N values of the next state
  std::array<double, 3> value{};         ///< Const; a Real uses element 0
  std::string name;                      ///< Input
  int index = 0;                         ///< Loop: count. LoopVar, LoopOut: which state element
  int scope = -1;                        ///< LoopVar: its loop's serial; else that of the loop it depends on, or -1
  std::string hint;                      ///< name given by named()
  std::shared_ptr<const Table> table{};  ///< Lookup
};

/// Owns the nodes of one recording; the innermost one alive on this thread is the current one.
class Recorder {
 public:
  Recorder();
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  static Recorder& current();
  int add(ExprNode node);
  /// The node equal to this one, or -1.
  int find(const ExprNode& node) const;
  const ExprNode& node(int id) const { return nodes_[std::size_t(id)]; }
  int size() const { return int(nodes_.size()); }
  void hint(int id, const char* name);
  int open_loop();
  void close_loop();

 private:
  using Key = std::tuple<Op, ExprType, std::vector<int>, std::array<double, 3>, std::string, int, int>;
  static Key key_of(const ExprNode& node);
  int scope_of(const ExprNode& node) const;

  std::vector<ExprNode> nodes_;
  std::map<Key, int> interned_;
  int loops_ = 0;
  bool in_loop_ = false;
  Recorder* outer_;
};

class Condition;

/// A recorded real number. A literal needs no recorder until it meets a node.
class Expr {
 public:
  Expr() = default;
  Expr(double literal) : literal_(literal) {}  // NOLINT: formulas mix literals and scalars
  static Expr input(const std::string& name);
  static Expr of_node(int id);

  bool is_literal() const { return id_ < 0; }
  bool is_literal(double value) const { return id_ < 0 && literal_ == value; }
  double literal() const { return literal_; }
  int id() const;  ///< interns a literal

  friend Expr operator-(const Expr&);
  friend Expr operator+(const Expr&, const Expr&);
  friend Expr operator-(const Expr&, const Expr&);
  friend Expr operator*(const Expr&, const Expr&);
  friend Expr operator/(const Expr&, const Expr&);

 private:
  int id_ = -1;
  double literal_ = 0;
};

/// A recorded comparison; converts to nothing, least of all to bool.
class Condition {
 public:
  explicit Condition(bool literal) : literal_(literal) {}
  static Condition of_node(int id);
  operator bool() const = delete;
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
Expr named(const char* name, const Expr&);

/// A recorded colour: one node, so that the printed text works on colours as the paper does.
template <> struct Rgb<Expr> {
  Rgb() = default;
  Rgb(const Expr& r, const Expr& g, const Expr& b);
  explicit Rgb(const Expr& grey);
  static Rgb input(const std::string& name);
  static Rgb of_node(int id);
  bool is_constant(std::array<double, 3>* value = nullptr) const;
  int id() const;

 private:
  int id_ = -1;  ///< -1: literal
  std::array<double, 3> literal_{};
};

Rgb<Expr> operator+(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> operator-(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> operator*(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> operator*(const Rgb<Expr>&, const Expr&);
Rgb<Expr> operator*(const Expr&, const Rgb<Expr>&);
Rgb<Expr> operator/(const Rgb<Expr>&, const Expr&);
Rgb<Expr> operator/(const Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr>& operator+=(Rgb<Expr>&, const Rgb<Expr>&);
Rgb<Expr> select(const Condition&, const Rgb<Expr>&, const Rgb<Expr>&);
Expr max_component(const Rgb<Expr>&);
Rgb<Expr> named(const char* name, const Rgb<Expr>&);

namespace detail {
Expr record_lookup(const std::shared_ptr<const Table>&, const std::vector<Expr>& coordinates);
std::vector<Expr> loop_variables(int count, int serial);
std::vector<Expr> close_loop(int count, int serial, const std::vector<Expr>& init, const std::vector<Expr>& next);
}  // namespace detail

/// Records a loop that stays a loop. Loops do not nest.
template <std::size_t N, class Step>
std::array<Expr, N> iterate(int count, const std::array<Expr, N>& state, Step step) {
  Recorder& recorder = Recorder::current();
  const int serial = recorder.open_loop();
  const std::vector<Expr> vars = detail::loop_variables(int(N), serial);
  std::array<Expr, N> in;
  std::copy(vars.begin(), vars.end(), in.begin());
  const std::array<Expr, N> next = step(in);
  recorder.close_loop();
  const std::vector<Expr> out =
      detail::close_loop(count, serial, {state.begin(), state.end()}, {next.begin(), next.end()});
  std::array<Expr, N> result;
  std::copy(out.begin(), out.end(), result.begin());
  return result;
}

/// The outputs of a recording: names and the nodes that give them.
class Program {
 public:
  void output(const std::string& name, const Expr& value) { outputs_.push_back({name, value.id()}); }
  void output(const std::string& name, const Rgb<Expr>& value) { outputs_.push_back({name, value.id()}); }

  /// OSL statements that assign every output (to variables declared by the caller), indented. The current
  /// recorder must be the one the outputs were recorded with. The text declares no name of `taken`, as it declares no
  /// osl_words(), inputs and outputs. The arrays that look-ups read come first or, one text each, in `arrays`.
  std::string print_osl(int indent, const std::vector<std::string>& taken,
                        std::vector<std::string>* arrays = nullptr) const;
  /// Operations the outputs reach: what the shader executes, selections with both arms.
  int operations() const;
  /// Names of the inputs the outputs depend on.
  std::vector<std::string> inputs() const;
  /// Executes the recording in T. Inputs by name; a missing one throws ExprError. A real is grey.
  template <class T> std::map<std::string, std::array<T, 3>> run(const std::map<std::string, std::array<T, 3>>&) const;

 private:
  const std::vector<bool>& reachable() const;
  std::vector<std::pair<std::string, int>> outputs_;
  mutable std::vector<bool> reachable_;  // of the first so many outputs
  mutable std::size_t outputs_seen_ = 0;
};

}  // namespace brdfc
