// SPDX-License-Identifier: GPL-3.0-or-later
// Prints a recorded program in any language: decides which values become variables, and in which order they stand.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// The tables that printed functions read, by name.
using Tables = std::map<std::string, std::shared_ptr<const Table>>;

/// Adds the tables that the program reads. Throws ExprError if two tables have the same name.
void add_tables(const Program&, Tables&);

/// Base class of the printers. Each language implements the virtual functions.
class ProgramPrinter {
 public:
  /// Statements declare no name in `taken`, and no name of an input or output. The program must outlive this object.
  ProgramPrinter(const Program&, const std::vector<std::string>& taken);
  virtual ~ProgramPrinter() = default;

  /// The statements that compute and assign the outputs.
  std::string statements(int indent);
  /// The number of these statements, without the heads of loops.
  int count() const { return count_; }
  /// The text of a value as an operand of an operator with this precedence, with parentheses where necessary.
  std::string use(int id, int precedence) const;

 protected:
  struct Text {
    std::string s;
    int precedence;  // 0 ternary, 1 logic, 2 comparison, 3 sum, 4 product, 5 unary, 6 atom
  };

  virtual Text text(int id) const = 0;
  /// True if the language reserves the name.
  virtual bool is_word(const std::string& name) const = 0;
  /// A base for numbered names: `name`, or another name if every `name` with a number would be reserved.
  virtual std::string free_base(const std::string& name) const { return name; }
  virtual std::string declaration(ExprType, const std::string& name, const std::string& value) const = 0;
  virtual std::string assignment(const std::string& name, const std::string& value) const = 0;
  virtual std::string loop_head(const std::string& counter, int count) const = 0;
  /// The line that closes a loop; empty if the language has none.
  virtual std::string loop_end() const = 0;

  std::string fresh(const std::string& base);
  Text call(const std::string& function, const ExprNode&) const;
  Text infix(const char* op, const ExprNode&, int precedence) const;
  const std::string& loop_out(const ExprNode&) const;

  const Program& program_;
  const std::vector<bool>& reachable_;

 private:
  void statements(int scope, int limit, int indent, std::string& out);
  bool wants_variable(int id) const;
  void declare(int id, int indent, std::string& out);
  void loop(int id, int indent, std::string& out);

  int count_ = 0;
  std::set<std::string> taken_;
  std::vector<int> uses_;
  std::map<int, std::string> names_;
  std::map<int, std::vector<std::string>> loop_vars_;
};

}  // namespace brdfc::print
