// SPDX-License-Identifier: GPL-3.0-or-later
// The graph in which a formula is recorded.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "tables/table.h"

namespace brdfc::inline trace {

/// A formula that a recording cannot express.
struct ExprError : std::logic_error {
  using std::logic_error::logic_error;
};

/// What a node computes from its arguments.
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

/// The name in messages, and in OSL for operations that exist there.
const char* name_of(Op);

/// The type of a node's value: a number, three numbers, or a truth value. A number used as a colour is grey.
enum class ExprType : std::uint8_t { Real, Color, Bool };

/// A node of the graph. The numbers of its arguments are smaller than its own.
struct ExprNode {
  Op op;
  ExprType type;
  std::vector<int> args;                 ///< numbers of nodes. Loop: N initial values, then N values of the next state
  std::array<double, 3> value{};         ///< Const; a Real uses element 0
  std::string name;                      ///< Input
  int index = 0;                         ///< Loop: count. LoopVar, LoopOut: index of the state element
  int scope = -1;                        ///< LoopVar: its loop's serial; others: that of the loop they depend on, or -1
  std::string hint;                      ///< name given by named()
  std::shared_ptr<const Table> table{};  ///< Lookup
};

/// The precision in which a recording will be executed.
enum class Precision : std::uint8_t { Single, Double };

/// Owns the nodes of one recording; equal nodes are stored once. The innermost Recorder alive on this thread is
/// current.
class Recorder {
 public:
  explicit Recorder(Precision = Precision::Single);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Throws ExprError if there is none.
  static Recorder& current();
  Precision precision() const { return precision_; }
  /// The number of a node equal to this one; adds the node if there is none. Throws ExprError if an argument belongs to
  /// another recorder.
  int add(ExprNode node);
  /// The node equal to this one, or -1.
  int find(const ExprNode& node) const;
  /// The node with a number from 0 to size() - 1.
  const ExprNode& node(int id) const { return nodes_[std::size_t(id)]; }
  int size() const { return int(nodes_.size()); }
  /// Sets the name of this node's value in a printed program; the first name stays.
  void hint(int id, const char* name);
  /// Begins a loop and returns its serial, which is the scope of its variables. Throws ExprError inside a loop.
  int open_loop();
  void close_loop();

 private:
  using Key = std::tuple<Op, ExprType, std::vector<int>, std::array<double, 3>, std::string, int, int>;
  static Key key_of(const ExprNode& node);
  int scope_of(const ExprNode& node) const;

  Precision precision_;
  std::vector<ExprNode> nodes_;
  std::map<Key, int> interned_;
  int loops_ = 0;
  bool in_loop_ = false;
  Recorder* outer_;
};

}  // namespace brdfc::inline trace
