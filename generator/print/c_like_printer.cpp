// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/c_like_printer.h"

#include <fmt/format.h>

namespace brdfc::print {

std::string library_name(Op op) { return std::string("brdfc_") + name_of(op); }

std::string CLikePrinter::declaration(ExprType type, const std::string& name, const std::string& value) const {
  return fmt::format("{} {}", type_name(type), assignment(name, value));
}
std::string CLikePrinter::assignment(const std::string& name, const std::string& value) const {
  return fmt::format("{} = {};", name, value);
}
std::string CLikePrinter::loop_head(const std::string& counter, int count) const {
  return fmt::format("for (int {0} = 0; {0} < {1}; {0}++) {{", counter, count);
}
std::string CLikePrinter::loop_end() const { return "}"; }

std::string CLikePrinter::arm(const ExprNode& n, std::size_t i, int precedence) const {
  const bool promote = n.type == ExprType::Color && program_.node(n.args[i]).type != ExprType::Color;
  return promote ? fmt::format("{}({})", type_name(n.type), use(n.args[i], 0)) : use(n.args[i], precedence);
}

ProgramPrinter::Text CLikePrinter::text(int id) const {
  const ExprNode& n = program_.node(id);
  switch (n.op) {
    case Op::Add:
    case Op::Sub:
      return infix(name_of(n.op), n, 3);
    case Op::Mul:
    case Op::Div:
      return infix(name_of(n.op), n, 4);
    case Op::Neg:
      return {fmt::format("-{}", use(n.args[0], 6)), 5};
    case Op::Sqrt:
    case Op::Abs:
    case Op::Min:
    case Op::Max:
      return call(name_of(n.op), n);
    case Op::Less:
    case Op::LessEqual:
      return infix(name_of(n.op), n, 2);
    case Op::And:
      return {use(n.args[0], 2) + " && " + use(n.args[1], 2), 1};
    case Op::Or:
      return {use(n.args[0], 2) + " || " + use(n.args[1], 2), 1};
    case Op::Not:
      return {fmt::format("!{}", use(n.args[0], 6)), 5};
    case Op::LoopOut:
      return {loop_out(n), 6};
    default:
      throw ExprError(std::string("no printer for ") + name_of(n.op));
  }
}

}  // namespace brdfc::print
