// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/statement.h"

#include <functional>

#include "print/osl_program.h"

namespace brdfc::print {
namespace {

/// Walks a tree and visits its values and the programs that it runs.
struct Visitor {
  std::function<void(const Value&)> value;
  std::function<void(const Program&)> program;

  void visit(const Value& v) const {
    value(v);
    for (const Value& a : v.args) visit(a);
  }
  void visit(const Statements& statements) const {
    for (const Statement& s : statements) std::visit([&](const auto& of) { visit(of); }, s.node().is);
  }
  void visit(const Declare& s) const {
    for (const Variable& v : s.variables)
      for (const Value& x : v.values) visit(x);
  }
  void visit(const Assign& s) const {
    visit(s.target);
    visit(s.value);
  }
  void visit(const Perform& s) const { visit(s.call); }
  void visit(const Increment& s) const { visit(Value(s.name)); }
  void visit(const If& s) const {
    visit(s.condition);
    visit(s.then);
    visit(s.otherwise);
  }
  void visit(const Cases& s) const {
    for (std::size_t i = 0; i < s.cases.size(); ++i) {
      if (i + 1 < s.cases.size()) visit(s.cases[i].first);
      visit(s.cases[i].second);
    }
  }
  void visit(const Loop& s) const {
    visit(s.end);
    visit(s.body);
  }
  void visit(const Block& s) const { visit(s.body); }
  void visit(const Run& s) const { program(*s.program); }
  void visit(const Array&) const {}
  void visit(const Continue&) const {}
  void visit(const Comment&) const {}
  void visit(const Gap&) const {}
};

Value chain(const std::vector<Value>& conditions, const char* sign) {
  Value all = conditions.at(0);
  for (std::size_t i = 1; i < conditions.size(); ++i) all = operation(std::move(all), sign, conditions[i]);
  return all;
}

}  // namespace

bool Run::operator==(const Run& other) const {
  return taken == other.taken && (program == other.program || *program == *other.program);
}
bool Statement::operator==(const Statement& other) const { return node_ == other.node_ || *node_ == *other.node_; }

Value call(std::string function, std::vector<Value> arguments) {
  return {Value::Kind::Call, std::move(function), std::move(arguments)};
}
Value quotation(std::string text) { return {Value::Kind::Text, std::move(text), {}}; }
Value element(Value of, Value index) { return {Value::Kind::Element, "", {std::move(of), std::move(index)}}; }
Value choice(Value condition, Value yes, Value no) {
  return {Value::Kind::Choice, "", {std::move(condition), std::move(yes), std::move(no)}};
}
Value operation(Value a, const char* sign, Value b) {
  return {Value::Kind::Operation, sign, {std::move(a), std::move(b)}};
}
Value all_of(const std::vector<Value>& conditions) { return chain(conditions, "&&"); }
Value any_of(const std::vector<Value>& conditions) { return chain(conditions, "||"); }

Value balanced_sum(const std::vector<Value>& terms) {
  if (terms.empty()) return 0;
  if (terms.size() == 1) return terms[0];
  const auto middle = terms.begin() + std::ptrdiff_t((terms.size() + 1) / 2);
  const auto half = [](const std::vector<Value>& some) {
    const Value sum = balanced_sum(some);
    return some.size() > 1 ? Value(Value::Kind::Group, "", {sum}) : sum;
  };
  return half({terms.begin(), middle}) + half({middle, terms.end()});
}

Statement declare(std::string type, std::string name) { return Declare{std::move(type), {{std::move(name)}}}; }
Statement declare(std::string type, std::string name, Value value) {
  return Declare{std::move(type), {{std::move(name), {std::move(value)}}}};
}
Statement declare_all(std::string type, const std::vector<std::string>& names) {
  Declare all{std::move(type), {}};
  for (const std::string& name : names) all.variables.push_back({name});
  return all;
}
Statement assign(Value target, Value value) { return Assign{std::move(target), std::move(value)}; }

Statements scope(Statements body) {
  if (body.empty()) return {};
  return {Block{std::move(body)}};
}

Statements run_with_arrays(const std::shared_ptr<const Program>& program, const std::vector<std::string>& taken) {
  Statements out;
  for (const ProgramArray& array : osl_arrays(*program, taken)) out.push_back(Array{array.name, array.table->values});
  out.push_back(Run{program, taken});
  return out;
}

void append(Statements& to, Statements more) {
  to.insert(to.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

std::set<std::string> names_in(const Statements& statements) {
  std::set<std::string> names;
  Visitor{[&](const Value& v) {
            if (v.kind == Value::Kind::Name) names.insert(v.word);
          },
          [&](const Program& p) {
            for (const std::string& input : p.inputs()) names.insert(input);
          }}
      .visit(statements);
  return names;
}

std::set<std::string> functions_in(const Statements& statements) {
  std::set<std::string> names;
  Visitor{[&](const Value& v) {
            if (v.kind == Value::Kind::Call) names.insert(v.word);
          },
          [&](const Program& p) { names.merge(library_calls(p)); }}
      .visit(statements);
  return names;
}

}  // namespace brdfc::print
