// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_program.h"

#include <fmt/format.h>

#include <map>

#include "print/c_like_printer.h"
#include "print/osl_table.h"
#include "print/osl_text.h"
#include "print/osl_words.h"

namespace brdfc::print {
namespace {

/// Operations that are functions of the library, because OSL lacks them.
bool is_of_library(Op op) { return op == Op::Log1p || op == Op::Expm1 || op == Op::MaxComponent; }

/// Prints values in OSL's syntax, each with its precedence.
class OslPrinter : public CLikePrinter {
 public:
  using CLikePrinter::CLikePrinter;

  /// The arrays that look-ups read; must be called before the statements are printed.
  std::vector<ProgramArray> arrays() {
    std::vector<ProgramArray> all;
    for (std::size_t i = 0; i < reachable_.size(); ++i) {
      const ExprNode& n = program_.node(int(i));
      if (!reachable_[i] || n.op != Op::Lookup || array_names_.count(n.name)) continue;
      const std::string name = fresh(n.name);
      array_names_[n.name] = name;
      all.push_back({name, n.table});
    }
    return all;
  }

 private:
  const char* type_name(ExprType t) const override {
    return t == ExprType::Color ? "color" : t == ExprType::Bool ? "int" : "float";
  }
  bool is_word(const std::string& name) const override { return is_osl_word(name); }
  std::string free_base(const std::string& name) const override { return unnumbered(name); }
  Text text(int id) const override {
    const ExprNode& n = program_.node(id);
    switch (n.op) {
      case Op::Const:
        if (n.type == ExprType::Bool) return {n.value[0] != 0 ? "1" : "0", 6};
        if (n.type == ExprType::Color) return {color(n.value), 6};
        return {number(n.value[0]), n.value[0] < 0 ? 5 : 6};
      case Op::Input:
        return {n.name, 6};
      case Op::Cbrt:
      case Op::Exp:
      case Op::Log:
      case Op::Sin:
      case Op::Cos:
      case Op::Atan:
      case Op::Pow:
      case Op::MakeColor:
        return call(name_of(n.op), n);
      case Op::Log1p:
      case Op::Expm1:
      case Op::MaxComponent:
        return call(library_name(n.op), n);
      case Op::Select:
        // Both arms of an OSL conditional must have one type.
        return {use(n.args[0], 1) + " ? " + arm(n, 1, 1) + " : " + arm(n, 2, 1), 0};
      case Op::Lookup: {
        std::string sizes, positions;
        for (std::size_t i = 0; i < n.args.size(); ++i) {
          const int size = n.table->axes[i].size();
          sizes += fmt::format(", {}", size);
          positions += fmt::format(", {} * clamp({}, 0.0, 1.0)", number(size - 1), use(n.args[i], 0));
        }
        return {table_function(*n.table) + "(" + array_names_.at(n.name) + sizes + positions + ")", 6};
      }
      default:
        return CLikePrinter::text(id);
    }
  }

  std::map<std::string, std::string> array_names_;
};

}  // namespace

OslText osl_assignments(const Program& program, int indent, const std::vector<std::string>& taken) {
  OslPrinter printer(program, taken);
  printer.arrays();
  OslText out{printer.statements(indent), printer.count() + int(program.outputs().size())};
  for (const auto& [name, id] : program.outputs())
    out.text += fmt::format("{:{}}{} = {};\n", "", indent, name, printer.use(id, 0));
  return out;
}

std::vector<ProgramArray> osl_arrays(const Program& program, const std::vector<std::string>& taken) {
  return OslPrinter(program, taken).arrays();
}

std::string osl_program(const Program& program, int indent, const std::vector<std::string>& taken) {
  std::string out;
  for (const ProgramArray& a : osl_arrays(program, taken)) out += compact_array(a.name, a.table->values, indent);
  return out + osl_assignments(program, indent, taken).text;
}

std::set<std::string> library_calls(const Program& program) {
  std::set<std::string> names;
  for (int id = 0; id < program.size(); ++id) {
    if (!program.reachable()[std::size_t(id)]) continue;
    const ExprNode& n = program.node(id);
    if (is_of_library(n.op)) names.insert(library_name(n.op));
    if (n.op == Op::Lookup) names.insert(table_function(*n.table));
  }
  return names;
}

}  // namespace brdfc::print
