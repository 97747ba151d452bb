// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/program_printer.h"

#include <fmt/format.h>

namespace brdfc::print {

void add_tables(const Program& program, Tables& tables) {
  const std::vector<bool>& reachable = program.reachable();
  for (std::size_t i = 0; i < reachable.size(); ++i) {
    if (!reachable[i]) continue;
    const ExprNode& n = program.node(int(i));
    if (n.op == Op::Lookup && tables.emplace(n.name, n.table).first->second != n.table)
      throw ExprError("two tables are named " + n.name);
  }
}

ProgramPrinter::ProgramPrinter(const Program& program, const std::vector<std::string>& taken)
    : program_(program),
      reachable_(program.reachable()),
      taken_(taken.begin(), taken.end()),
      uses_(reachable_.size(), 0) {
  for (const std::string& name : program.inputs()) taken_.insert(name);
  for (std::size_t i = 0; i < reachable_.size(); ++i)
    if (reachable_[i])
      for (int a : program_.node(int(i)).args) ++uses_[std::size_t(a)];
  for (const auto& [name, id] : program.outputs()) {
    taken_.insert(name);
    ++uses_[std::size_t(id)];
  }
}

std::string ProgramPrinter::statements(int indent) {
  std::string out;
  statements(-1, program_.size(), indent, out);
  return out;
}

/// Statements of one scope (-1: outside every loop).
void ProgramPrinter::statements(int scope, int limit, int indent, std::string& out) {
  for (int id = 0; id < limit; ++id) {
    const ExprNode& n = program_.node(id);
    if (!reachable_[std::size_t(id)] || n.scope != scope) continue;
    if (n.op == Op::Loop)
      loop(id, indent, out);
    else if (wants_variable(id))
      declare(id, indent, out);
  }
}

std::string ProgramPrinter::use(int id, int precedence) const {
  const auto it = names_.find(id);
  if (it != names_.end()) return it->second;
  const Text t = text(id);
  return t.precedence < precedence ? "(" + t.s + ")" : t.s;
}

bool ProgramPrinter::wants_variable(int id) const {
  const ExprNode& n = program_.node(id);
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

std::string ProgramPrinter::fresh(const std::string& base) {
  const std::string start = free_base(base);
  std::string name = start;
  for (int i = 1; is_word(name) || !taken_.insert(name).second; ++i) name = fmt::format("{}_{}", start, i);
  return name;
}

void ProgramPrinter::declare(int id, int indent, std::string& out) {
  const ExprNode& n = program_.node(id);
  const std::string value = text(id).s;
  const std::string name = fresh(n.hint.empty() ? "t" : n.hint);
  out += fmt::format("{:{}}{}\n", "", indent, declaration(n.type, name, value));
  ++count_;
  names_[id] = name;
}

void ProgramPrinter::loop(int id, int indent, std::string& out) {
  const ExprNode& n = program_.node(id);
  const std::size_t size = n.args.size() / 2;
  const int serial = int(n.value[0]);
  const auto line = [&](int in, const std::string& statement) { out += fmt::format("{:{}}{}\n", "", in, statement); };
  std::vector<std::string> vars;
  for (std::size_t k = 0; k < size; ++k) {
    vars.push_back(fresh(fmt::format("x{}", k)));
    line(indent, declaration(ExprType::Real, vars[k], use(n.args[k], 0)));
  }
  for (int v = 0; v < id; ++v)
    if (program_.node(v).op == Op::LoopVar && program_.node(v).scope == serial)
      names_[v] = vars[std::size_t(program_.node(v).index)];
  line(indent, loop_head(fresh("i"), n.index));
  statements(serial, id, indent + 4, out);
  // Compute the whole next state before assigning any of it, because one element may use the old value of another.
  std::vector<std::string> next;
  for (std::size_t k = 0; k < size; ++k) {
    next.push_back(fresh(fmt::format("next{}", k)));
    line(indent + 4, declaration(ExprType::Real, next[k], use(n.args[size + k], 0)));
  }
  for (std::size_t k = 0; k < size; ++k) line(indent + 4, assignment(vars[k], next[k]));
  count_ += int(3 * size);
  if (const std::string end = loop_end(); !end.empty()) line(indent, end);
  loop_vars_[id] = std::move(vars);
}

ProgramPrinter::Text ProgramPrinter::call(const std::string& function, const ExprNode& n) const {
  std::string s = function + "(";
  for (std::size_t i = 0; i < n.args.size(); ++i) s += (i ? ", " : "") + use(n.args[i], 0);
  return {s + ")", 6};
}

ProgramPrinter::Text ProgramPrinter::infix(const char* op, const ExprNode& n, int precedence) const {
  // Left-associative, as C, OSL and Python read it; the grouping of floating-point operations must survive.
  return {use(n.args[0], precedence) + " " + op + " " + use(n.args[1], precedence + 1), precedence};
}

const std::string& ProgramPrinter::loop_out(const ExprNode& n) const {
  return loop_vars_.at(n.args[0])[std::size_t(n.index)];
}

}  // namespace brdfc::print
