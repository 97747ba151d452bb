// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_statements.h"

#include <fmt/format.h>

#include <map>
#include <stdexcept>
#include <string_view>

#include "print/osl_program.h"
#include "print/osl_table.h"
#include "print/osl_text.h"

namespace brdfc::print {
namespace {

/// Precedence of the kinds of values, lowest first.
enum Precedence : int { kChoice, kOr, kAnd, kComparison, kSum, kProduct, kUnary, kAtom };

int precedence_of_sign(std::string_view sign) {
  static const std::map<std::string_view, int> of = {{"||", kOr},         {"&&", kAnd},       {"<", kComparison},
                                                     {"<=", kComparison}, {">", kComparison}, {"==", kComparison},
                                                     {"!=", kComparison}, {"+", kSum},        {"-", kSum},
                                                     {"*", kProduct},     {"/", kProduct}};
  return of.at(sign);
}

int precedence_of(const Value& v) {
  switch (v.kind) {
    case Value::Kind::Operation:
      return precedence_of_sign(v.word);
    case Value::Kind::Choice:
      return kChoice;
    case Value::Kind::Unary:
      return kUnary;
    case Value::Kind::Number:
    case Value::Kind::Integer:
      return v.number < 0 ? kUnary : kAtom;
    default:
      return kAtom;
  }
}

std::string list(const std::vector<Value>& values) {
  std::string out;
  for (const Value& v : values) out += (out.empty() ? "" : ", ") + osl_value(v);
  return out;
}

/// The value as an operand of an operator with this precedence.
std::string operand(const Value& v, int precedence) {
  return precedence_of(v) < precedence ? "(" + osl_value(v) + ")" : osl_value(v);
}

class Printer {
 public:
  explicit Printer(int level) : level_(level) {}

  void print(const Statements& statements) {
    for (const Statement& s : statements) std::visit([&](const auto& of) { print(of); }, s.node().is);
  }
  OslText take() { return std::move(out_); }

 private:
  std::string indent() const { return std::string(4 * std::size_t(level_), ' '); }
  void line(const std::string& text) { out_.text += indent() + text + "\n"; }
  void statement(const std::string& text) {
    line(text + ";");
    ++out_.statements;
  }
  void deeper(const Statements& body) {
    ++level_;
    print(body);
    --level_;
  }
  /// True if the body can follow its head without braces.
  static bool is_single(const Statements& body) {
    if (body.size() != 1) return false;
    const auto& only = body[0].node().is;
    return std::holds_alternative<Assign>(only) || std::holds_alternative<Continue>(only) ||
           std::holds_alternative<If>(only) || std::holds_alternative<Loop>(only);
  }

  void print(const Declare& s) {
    std::string text;
    for (const Variable& v : s.variables) {
      text += (text.empty() ? "" : ", ") + v.name;
      if (v.size > 0) text += fmt::format("[{}]", v.size);
      if (!v.values.empty()) text += " = " + (v.size > 0 ? "{" + list(v.values) + "}" : osl_value(v.values.at(0)));
    }
    statement(s.type + " " + text);
  }
  void print(const Array& s) {
    const bool dense = s.layout == Array::Layout::Dense;
    out_.text +=
        indented(dense ? compact_array(s.name, s.values, 4) : array(s.name, s.values), std::size_t(level_ - 1));
    ++out_.statements;
  }
  void print(const Assign& s) { statement(fmt::format("{} {} {}", osl_value(s.target), s.sign, osl_value(s.value))); }
  void print(const Perform& s) { statement(osl_value(s.call)); }
  void print(const Increment& s) { statement(s.name + "++"); }
  void print(const Continue&) { statement("continue"); }
  void print(const If& s) {
    const std::string head = fmt::format("if ({})", osl_value(s.condition));
    if (is_single(s.then) && s.otherwise.empty()) {
      line(head);
      deeper(s.then);
      return;
    }
    line(head + " {");
    deeper(s.then);
    if (!s.otherwise.empty()) {
      line("} else {");
      deeper(s.otherwise);
    }
    line("}");
  }
  void print(const Cases& s) {
    for (std::size_t i = 0; i < s.cases.size(); ++i) {
      const bool last = i > 0 && i + 1 == s.cases.size();
      line((i == 0 ? "" : "} else ") + (last ? std::string() : fmt::format("if ({}) ", osl_value(s.cases[i].first))) +
           "{");
      deeper(s.cases[i].second);
    }
    line("}");
  }
  void print(const Loop& s) {
    const std::string head =
        fmt::format("for (int {0} = 0; {0} {1} {2}; {0}++)", s.counter, s.inclusive ? "<=" : "<", osl_value(s.end));
    const bool single = is_single(s.body);
    line(single ? head : head + " {");
    deeper(s.body);
    if (!single) line("}");
  }
  void print(const Block& s) {
    line("{");
    deeper(s.body);
    line("}");
  }
  void print(const Run& s) {
    const OslText program = osl_assignments(*s.program, 4 * level_, s.taken);
    out_.text += program.text;
    out_.statements += program.statements;
  }
  void print(const Comment& s) { line("// " + s.text); }
  void print(const Gap&) { out_.text += "\n"; }

  OslText out_;
  int level_;
};

}  // namespace

OslText osl_statements(const Statements& statements, int level) {
  Printer printer(level);
  printer.print(statements);
  return printer.take();
}

std::string osl_value(const Value& v) {
  switch (v.kind) {
    case Value::Kind::Name:
      return v.word;
    case Value::Kind::Number:
      return number(v.number);
    case Value::Kind::Integer:
      return fmt::format("{}", int(v.number));
    case Value::Kind::Text:
      return quoted(v.word);
    case Value::Kind::Call:
      return v.word + "(" + list(v.args) + ")";
    case Value::Kind::Element:
      return operand(v.args.at(0), kAtom) + "[" + osl_value(v.args.at(1)) + "]";
    case Value::Kind::Unary:
      return v.word + operand(v.args.at(0), kAtom);
    case Value::Kind::Operation: {
      // Left-associative, as OSL reads it: the grouping of floating-point operations must survive.
      const int own = precedence_of_sign(v.word);
      return fmt::format("{} {} {}", operand(v.args.at(0), own), v.word, operand(v.args.at(1), own + 1));
    }
    case Value::Kind::Choice:
      return fmt::format("{} ? {} : {}", operand(v.args.at(0), kOr), operand(v.args.at(1), kOr),
                         operand(v.args.at(2), kChoice));
    case Value::Kind::Group:
      return "(" + osl_value(v.args.at(0)) + ")";
  }
  throw std::logic_error("no OSL for a value");
}

}  // namespace brdfc::print
