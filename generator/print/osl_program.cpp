// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_program.h"

#include <fmt/format.h>

#include <map>
#include <set>

#include "print/osl_table.h"
#include "print/osl_text.h"
#include "print/osl_words.h"

namespace brdfc::print {
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
      all.push_back(compact_array(name, n.table->values, indent));
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

  Text call(const std::string& function, const ExprNode& n) const {
    std::string s = function + "(";
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
        if (n.type == ExprType::Color) return {color(n.value), 6};
        return {number(n.value[0]), n.value[0] < 0 ? 5 : 6};
      case Op::Input:
        return {n.name, 6};
      case Op::Add:
      case Op::Sub:
        return infix(name_of(n.op), n, 3);
      case Op::Mul:
      case Op::Div:
        return infix(name_of(n.op), n, 4);
      case Op::Neg:
        return {fmt::format("-{}", use(n.args[0], 6)), 5};
      case Op::Sqrt:
      case Op::Cbrt:
      case Op::Exp:
      case Op::Log:
      case Op::Sin:
      case Op::Cos:
      case Op::Atan:
      case Op::Pow:
      case Op::Abs:
      case Op::Min:
      case Op::Max:
      case Op::MakeColor:
        return call(name_of(n.op), n);
      case Op::Log1p:
      case Op::Expm1:
      case Op::MaxComponent:
        return call(std::string("brdfc_") + name_of(n.op), n);
      case Op::Less:
      case Op::LessEqual:
        return infix(name_of(n.op), n, 2);
      case Op::And:
        return {use(n.args[0], 2) + " && " + use(n.args[1], 2), 1};
      case Op::Or:
        return {use(n.args[0], 2) + " || " + use(n.args[1], 2), 1};
      case Op::Not:
        return {fmt::format("!{}", use(n.args[0], 6)), 5};
      case Op::Select: {
        // Both arms of an OSL conditional must have one type.
        const auto arm = [&](std::size_t i) {
          const bool promote = n.type == ExprType::Color && r_.node(n.args[i]).type != ExprType::Color;
          return promote ? "color(" + use(n.args[i], 0) + ")" : use(n.args[i], 1);
        };
        return {use(n.args[0], 1) + " ? " + arm(1) + " : " + arm(2), 0};
      }
      case Op::Lookup: {
        std::vector<std::string> positions;
        for (std::size_t i = 0; i < n.args.size(); ++i)
          positions.push_back(
              fmt::format("{} * clamp({}, 0.0, 1.0)", number(n.table->axes[i].size() - 1), use(n.args[i], 0)));
        return {table_call(*n.table, array_names_.at(n.name), positions), 6};
      }
      case Op::LoopOut:
        return {loop_vars_.at(n.args[0])[std::size_t(n.index)], 6};
      default:
        throw ExprError(std::string("no OSL for ") + name_of(n.op));
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

std::string osl_program(const Program& program, int indent, const std::vector<std::string>& taken,
                        std::vector<std::string>* arrays) {
  std::vector<std::string> reserved = taken;
  for (const std::string& name : program.inputs()) reserved.push_back(name);
  for (const auto& [name, id] : program.outputs()) reserved.push_back(name);
  OslPrinter printer(program.reachable(), reserved);
  for (const auto& [name, id] : program.outputs()) printer.count_output(id);
  std::string out;
  for (const std::string& array : printer.arrays(arrays ? 4 : indent)) {
    if (arrays)
      arrays->push_back(array);
    else
      out += array;
  }
  printer.statements(-1, Recorder::current().size(), indent, out);
  for (const auto& [name, id] : program.outputs())
    out += fmt::format("{:{}}{} = {};\n", "", indent, name, printer.use(id, 0));
  return out;
}

}  // namespace brdfc::print
