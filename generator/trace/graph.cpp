// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/graph.h"

#include <algorithm>

namespace brdfc::inline trace {
namespace {

thread_local Recorder* current_recorder = nullptr;

}  // namespace

const char* name_of(Op op) {
  static const char* const names[] = {
      "constant",    "input",  "+",     "-",   "*",   "/",      "negation",      "sqrt",  "cbrt", "exp",
      "log",         "log1p",  "expm1", "sin", "cos", "atan",   "pow",           "abs",   "min",  "max",
      "<",           "<=",     "and",   "or",  "not", "select", "max_component", "color", "loop", "loop variable",
      "loop result", "look-up"};
  return names[int(op)];
}

Recorder::Recorder(Precision precision) : precision_(precision), outer_(current_recorder) { current_recorder = this; }
Recorder::~Recorder() { current_recorder = outer_; }

Recorder& Recorder::current() {
  if (!current_recorder) throw ExprError("an Expr met another without a Recorder");
  return *current_recorder;
}

Recorder::Key Recorder::key_of(const ExprNode& n) { return {n.op, n.type, n.args, n.value, n.name, n.index, n.scope}; }

int Recorder::scope_of(const ExprNode& node) const {
  int scope = node.scope;
  for (int a : node.args) {
    if (a < 0 || a >= size()) throw ExprError("an Expr of another Recorder");
    if (node.op != Op::Loop) scope = std::max(scope, nodes_[std::size_t(a)].scope);
  }
  return scope;
}

int Recorder::find(const ExprNode& node) const {
  ExprNode scoped = node;
  scoped.scope = scope_of(node);
  const auto it = interned_.find(key_of(scoped));
  return it == interned_.end() ? -1 : it->second;
}

int Recorder::add(ExprNode node) {
  node.scope = scope_of(node);
  const auto [it, inserted] = interned_.emplace(key_of(node), size());
  if (inserted) nodes_.push_back(std::move(node));
  return it->second;
}

void Recorder::hint(int id, const char* name) {
  ExprNode& n = nodes_[std::size_t(id)];
  if (n.hint.empty() && n.op != Op::Const && n.op != Op::Input) n.hint = name;
}

int Recorder::open_loop() {
  if (in_loop_) throw ExprError("a loop inside a loop cannot be recorded");
  in_loop_ = true;
  return loops_++;
}
void Recorder::close_loop() { in_loop_ = false; }

}  // namespace brdfc::inline trace
