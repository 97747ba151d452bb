// SPDX-License-Identifier: GPL-3.0-or-later
// What printing a recorded program takes in any language: which values get names, and in what order they stand.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// A language derives from this and spells what is virtual.
class ProgramPrinter {
 public:
  /// No statement declares a name of `taken`, of an input or of an output. The program must outlive it.
  ProgramPrinter(const Program&, const std::vector<std::string>& taken);
  virtual ~ProgramPrinter() = default;

  /// The statements that the outputs need.
  std::string statements(int indent);
  /// How many those are, without the heads of loops.
  int count() const { return count_; }
  /// A value as an operand of something that binds as tightly as that.
  std::string use(int id, int precedence) const;

 protected:
  struct Text {
    std::string s;
    int precedence;  // 0 ternary, 1 logic, 2 comparison, 3 sum, 4 product, 5 unary, 6 atom
  };

  virtual Text text(int id) const = 0;
  /// Whether the language has the name for something else.
  virtual bool is_word(const std::string& name) const = 0;
  /// The name, or another if no number after it could make it one that is free.
  virtual std::string free_base(const std::string& name) const { return name; }
  virtual std::string declaration(ExprType, const std::string& name, const std::string& value) const = 0;
  virtual std::string assignment(const std::string& name, const std::string& value) const = 0;
  virtual std::string loop_head(const std::string& counter, int count) const = 0;
  /// What closes a loop, "" for nothing.
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
