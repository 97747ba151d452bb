// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/numpy.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <string_view>

#include "core/text.h"

namespace brdfc::print {
bool is_python_word(const std::string& name) {
  static const std::set<std::string_view> words = {
      "False",    "None",   "True", "and",    "as",    "assert", "async", "await",    "break",  "class",
      "continue", "def",    "del",  "elif",   "else",  "except", "for",   "from",     "global", "if",
      "in",       "import", "is",   "lambda", "not",   "or",     "pass",  "nonlocal", "raise",  "return",
      "try",      "while",  "with", "yield",  "match", "case",   "np",    "range"};
  return words.count(name) > 0 || name.starts_with("table_");
}

namespace {

class NumpyPrinter : public ProgramPrinter {
 public:
  using ProgramPrinter::ProgramPrinter;

 private:
  bool is_word(const std::string& name) const override { return is_python_word(name); }
  std::string free_base(const std::string& name) const override {
    return name.starts_with("table_") ? fmt::format("model_{}", name) : name;
  }
  std::string declaration(ExprType, const std::string& name, const std::string& value) const override {
    return assignment(name, value);
  }
  std::string assignment(const std::string& name, const std::string& value) const override {
    return name + " = " + value;
  }
  std::string loop_head(const std::string& i, int count) const override {
    return fmt::format("for {} in range({}):", i, count);
  }
  std::string loop_end() const override { return ""; }

  static const char* function_name(Op op) {
    switch (op) {
      case Op::Atan:
        return "np.arctan";
      case Op::Pow:
        return "np.power";
      case Op::Abs:
        return "np.abs";
      case Op::Min:
        return "np.minimum";
      case Op::Max:
        return "np.maximum";
      case Op::Sqrt:
        return "np.sqrt";
      case Op::Cbrt:
        return "np.cbrt";
      case Op::Exp:
        return "np.exp";
      case Op::Log:
        return "np.log";
      case Op::Log1p:
        return "np.log1p";
      case Op::Expm1:
        return "np.expm1";
      case Op::Sin:
        return "np.sin";
      case Op::Cos:
        return "np.cos";
      case Op::Not:
        return "np.logical_not";
      case Op::Select:
        return "np.where";
      case Op::MakeColor:
        return "np.rgb";
      default:
        throw ExprError(std::string("no NumPy for ") + name_of(op));
    }
  }

  Text text(int id) const override {
    const ExprNode& n = program_.node(id);
    switch (n.op) {
      case Op::Const:
        if (n.type == ExprType::Bool) return {n.value[0] != 0 ? "True" : "False", 6};
        if (n.type == ExprType::Color)
          return {fmt::format("np.rgb({}, {}, {})", python_number(n.value[0]), python_number(n.value[1]),
                              python_number(n.value[2])),
                  6};
        return {python_number(n.value[0]), std::signbit(n.value[0]) ? 5 : 6};
      case Op::Input:
        return {n.name, 6};
      case Op::Add:
        return infix("+", n, 3);
      case Op::Sub:
        return infix("-", n, 3);
      case Op::Mul:
        return infix("*", n, 4);
      case Op::Div:
        return infix("/", n, 4);
      case Op::Neg:
        return {fmt::format("-{}", use(n.args[0], 6)), 5};
      case Op::Less:
        return infix("<", n, 3);
      case Op::LessEqual:
        return infix("<=", n, 3);
      // In Python these bind more tightly than comparisons, so both they and their operands get parentheses.
      case Op::And:
        return {use(n.args[0], 6) + " & " + use(n.args[1], 6), 0};
      case Op::Or:
        return {use(n.args[0], 6) + " | " + use(n.args[1], 6), 0};
      case Op::MaxComponent:
        return {fmt::format("np.max({}, axis=0)", use(n.args[0], 0)), 6};
      case Op::Lookup: {
        std::string s = fmt::format("np.lookup(table_{}", n.name);
        for (int a : n.args) s += ", " + use(a, 0);
        return {s + ")", 6};
      }
      case Op::LoopOut:
        return {loop_out(n), 6};
      default:
        return call(function_name(n.op), n);
    }
  }
};

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

/// Wraps between words if a line would be longer than 100 characters.
std::string wrapped(const std::string& text, int indent) {
  std::string out;
  std::size_t width = std::size_t(indent), start = 0;
  while (start < text.size()) {
    std::size_t end = text.find(' ', start);
    if (end == std::string::npos) end = text.size();
    const bool first = start == 0;
    if (!first && width + 1 + end - start > 100) {
      out += fmt::format("\n{:{}}", "", indent);
      width = std::size_t(indent);
    } else if (!first) {
      out += ' ';
      ++width;
    }
    out.append(text, start, end - start);
    width += end - start;
    start = end + 1;
  }
  return out;
}

}  // namespace

std::string python_number(double v) {
  if (!std::isfinite(v)) throw ExprError(fmt::format("{} is no number that a formula may hold", v));
  std::string s = fmt::format("{}", v);
  if (s.find_first_of(".e") == std::string::npos) s += ".0";
  return s;
}

std::string python_string(const std::string& text) { return fmt::format("\"{}\"", escaped(text)); }

std::string python_docstring(const std::vector<std::string>& paragraphs, int indent) {
  std::string out = "\"\"\"";
  bool first = true;
  for (const std::string& p : paragraphs) {
    if (!first) out += fmt::format("\n\n{:{}}", "", indent);
    first = false;
    std::size_t start = 0;
    while (start <= p.size()) {
      const std::size_t end = std::min(p.find('\n', start), p.size());
      if (start > 0) out += fmt::format("\n{:{}}", "", indent);
      out += wrapped(escaped(p.substr(start, end - start)), indent);
      start = end + 1;
    }
  }
  const bool one_line = out.find('\n') == std::string::npos && out.size() + std::size_t(indent) < 100;
  return one_line ? out + "\"\"\"\n" : out + fmt::format("\n{:{}}\"\"\"\n", "", indent);
}

std::string numpy_table(const Table& table) {
  std::vector<int> sizes;
  for (const TableAxis& a : table.axes) sizes.push_back(a.size());
  std::string out =
      fmt::format("table_{} = table(({}{}), \"\"\"", table.name, join(sizes, ", "), sizes.size() == 1 ? "," : "");
  std::size_t width = 200;
  for (double v : table.values) {
    const std::string s = fmt::format("{}", v);
    if (width + s.size() + 1 > 100) {
      out += '\n';
      width = 0;
    } else {
      out += ' ';
      ++width;
    }
    out += s;
    width += s.size();
  }
  return out + "\n\"\"\")\n";
}

std::string numpy_function(const Program& program, const std::string& name, const std::vector<std::string>& arguments,
                           Tables& tables) {
  add_tables(program, tables);
  std::string out = fmt::format("def {}(np", name);
  for (const std::string& a : arguments) {
    if (is_python_word(a)) throw ExprError("Python can't have an argument named " + a);
    out += ", " + a;
  }
  out += "):\n";
  NumpyPrinter printer(program, arguments);
  out += printer.statements(4);
  out += "    return ";
  for (const auto& output : program.outputs())
    out += (&output == &program.outputs().front() ? "" : ", ") + printer.use(output.second, 0);
  return out + "\n";
}

}  // namespace brdfc::print
