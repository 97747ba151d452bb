// SPDX-License-Identifier: GPL-3.0-or-later
// Statements of a shader as data. Forms build trees of statements, and osl_statements.h prints them. The names that a
// shader reads, the functions that it calls and its closures are found by walking the tree.
#pragma once

#include <concepts>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// A value in a statement: a tree of names, literals, operations and calls. A string that is converted becomes a name.
struct Value {
  enum class Kind {
    Name,
    Number,
    Integer,
    Text,       ///< a string literal
    Call,       ///< a call of the function `word`
    Element,    ///< an element of an array or vector; arguments: the array, the index
    Unary,      ///< `word` is the operator in front of the argument
    Operation,  ///< `word` is the operator between the arguments
    Choice,     ///< the ternary operator; arguments: the condition, the values if true and if false
    Group       ///< redundant parentheses around the argument
  };

  Value(const char* name) : word(name) {}             // NOLINT: a name
  Value(std::string name) : word(std::move(name)) {}  // NOLINT
  Value(double n) : kind(Kind::Number), number(n) {}  // NOLINT: a literal
  Value(int n) : kind(Kind::Integer), number(n) {}    // NOLINT
  Value(Kind of, std::string w, std::vector<Value> a) : kind(of), word(std::move(w)), args(std::move(a)) {}

  Kind kind = Kind::Name;
  std::string word;
  double number = 0;
  std::vector<Value> args;

  bool operator==(const Value&) const = default;
};

Value call(std::string function, std::vector<Value> arguments = {});
Value quotation(std::string text);
Value element(Value of, Value index);
Value choice(Value condition, Value yes, Value no);
/// The operation a `sign` b, for any binary operator.
Value operation(Value a, const char* sign, Value b);
Value all_of(const std::vector<Value>& conditions);
Value any_of(const std::vector<Value>& conditions);
/// The sum of the terms as a balanced tree. Cycles walks sums with a stack of 16, so a long chain would lose terms.
Value balanced_sum(const std::vector<Value>& terms);
inline Value operator+(Value a, Value b) { return operation(std::move(a), "+", std::move(b)); }
inline Value operator*(Value a, Value b) { return operation(std::move(a), "*", std::move(b)); }
inline Value operator-(Value a) { return {Value::Kind::Unary, "-", {std::move(a)}}; }
inline Value operator!(Value a) { return {Value::Kind::Unary, "!", {std::move(a)}}; }

/// One of the kinds below. Copies share their contents, which are immutable.
class Statement {
 public:
  template <class S>
  requires(!std::same_as<std::remove_cvref_t<S>, Statement>) Statement(S s)
      : node_(std::make_shared<const Node>(Node{std::move(s)})) {}  // NOLINT: a statement of this kind

  struct Node;
  const Node& node() const { return *node_; }
  bool operator==(const Statement&) const;

 private:
  std::shared_ptr<const Node> node_;
};
using Statements = std::vector<Statement>;

/// Declares a variable, with or without a value, or an array with `size` elements, with or without their values.
struct Variable {
  std::string name;
  std::vector<Value> values = {};
  int size = 0;
  bool operator==(const Variable&) const = default;
};
struct Declare {
  std::string type;
  std::vector<Variable> variables;
  bool operator==(const Declare&) const = default;
};
/// Declares an array of numbers.
struct Array {
  /// Dense: as short as possible; Aligned: readable.
  enum class Layout { Dense, Aligned };
  std::string name;
  std::vector<double> values;
  Layout layout = Layout::Dense;
  bool operator==(const Array&) const = default;
};
struct Assign {
  Value target, value;
  std::string sign = "=";  ///< =, +=, *= or /=
  bool operator==(const Assign&) const = default;
};
/// A call for its side effects.
struct Perform {
  Value call;
  bool operator==(const Perform&) const = default;
};
/// Increments a variable.
struct Increment {
  std::string name;
  bool operator==(const Increment&) const = default;
};
/// Continues with the next iteration of the loop.
struct Continue {
  bool operator==(const Continue&) const = default;
};
struct If {
  Value condition;
  Statements then;
  Statements otherwise = {};
  bool operator==(const If&) const = default;
};
/// Exclusive cases, like if, else if, else. The last one needs no condition.
struct Cases {
  std::vector<std::pair<Value, Statements>> cases;
  bool operator==(const Cases&) const = default;
};
/// A loop with a counter from 0 up to `end`, exclusive or inclusive.
struct Loop {
  std::string counter;
  Value end;
  Statements body;
  bool inclusive = false;
  bool operator==(const Loop&) const = default;
};
/// A scope of its own for declarations.
struct Block {
  Statements body;
  bool operator==(const Block&) const = default;
};
/// The assignments of a recorded program, which declare no name in `taken`. The arrays that it looks up must be
/// declared before (print/osl_program.h).
struct Run {
  std::shared_ptr<const Program> program;
  std::vector<std::string> taken;
  bool operator==(const Run&) const;
};
struct Comment {
  std::string text;
  bool operator==(const Comment&) const = default;
};
/// An empty line.
struct Gap {
  bool operator==(const Gap&) const = default;
};

struct Statement::Node {
  std::variant<Declare, Array, Assign, Perform, Increment, Continue, If, Cases, Loop, Block, Run, Comment, Gap> is;
  bool operator==(const Node&) const = default;
};

Statement declare(std::string type, std::string name);
Statement declare(std::string type, std::string name, Value value);
Statement declare_all(std::string type, const std::vector<std::string>& names);
Statement assign(Value target, Value value);
/// A block of the statements, or nothing if there are none.
Statements scope(Statements);
/// Declares the arrays that a program looks up, and runs it.
Statements run_with_arrays(const std::shared_ptr<const Program>&, const std::vector<std::string>& taken);
void append(Statements& to, Statements more);

/// All variables and parameters that are named in values or are inputs of recorded programs.
std::set<std::string> names_in(const Statements&);
/// All functions that are called in values, and the library functions that recorded programs call.
std::set<std::string> functions_in(const Statements&);

}  // namespace brdfc::print
