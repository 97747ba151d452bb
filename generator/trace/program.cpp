// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/program.h"

#include <algorithm>

#include "trace/op.h"
#include "trace/osl_arithmetic.h"

namespace brdfc::inline trace {
namespace {

template <class T> T execute(Op op, const T* a) {
  if constexpr (std::is_same_v<T, float>)
    if (OslArithmetic::active()) return apply_as_osl(op, a);
  return apply(op, a);
}

}  // namespace

const std::vector<bool>& Program::reachable() const {
  const Recorder& r = Recorder::current();
  std::vector<bool>& seen = reachable_;
  // Nodes and outputs are added, never changed.
  if (seen.size() == std::size_t(r.size()) && outputs_seen_ == outputs_.size()) return seen;
  seen.assign(std::size_t(r.size()), false);
  outputs_seen_ = outputs_.size();
  std::vector<int> stack;
  for (const auto& [name, id] : outputs_) stack.push_back(id);
  while (!stack.empty()) {
    const int id = stack.back();
    stack.pop_back();
    if (seen[std::size_t(id)]) continue;
    seen[std::size_t(id)] = true;
    for (int a : r.node(id).args) stack.push_back(a);
  }
  return seen;
}

int Program::operations() const {
  const std::vector<bool>& seen = reachable();
  int count = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Op op = Recorder::current().node(int(i)).op;
    if (seen[i] && op != Op::Const && op != Op::Input && op != Op::LoopVar && op != Op::LoopOut) ++count;
  }
  return count;
}

std::vector<std::string> Program::inputs() const {
  const std::vector<bool>& seen = reachable();
  std::vector<std::string> names;
  for (std::size_t i = 0; i < seen.size(); ++i)
    if (seen[i] && Recorder::current().node(int(i)).op == Op::Input)
      names.push_back(Recorder::current().node(int(i)).name);
  return names;
}

template <class T> std::map<std::string, std::array<T, 3>> Program::run(const Inputs<T>& inputs) const {
  const Recorder& r = Recorder::current();
  const std::vector<bool>& seen = reachable();
  std::vector<std::array<T, 3>> value(std::size_t(r.size()));
  const auto compute = [&](int id) {
    const ExprNode& n = r.node(id);
    std::array<T, 3>& out = value[std::size_t(id)];
    const auto arg = [&](std::size_t i) -> const std::array<T, 3>& { return value[std::size_t(n.args[i])]; };
    switch (n.op) {
      case Op::Const:
        out = {T(n.value[0]), T(n.value[1]), T(n.value[2])};
        break;
      case Op::Input: {
        const auto it = inputs.find(n.name);
        if (it == inputs.end()) throw ExprError("no value for input " + n.name);
        out = it->second;
        break;
      }
      case Op::MaxComponent:
        out.fill(std::max({arg(0)[0], arg(0)[1], arg(0)[2]}));
        break;
      case Op::MakeColor:
        out = {arg(0)[0], arg(1)[0], arg(2)[0]};
        break;
      case Op::Lookup: {
        std::vector<T> at;
        for (std::size_t i = 0; i < n.args.size(); ++i) at.push_back(arg(i)[0]);
        out.fill(lookup(n.table, at));
        break;
      }
      case Op::LoopVar:
        break;  // set by the loop
      case Op::LoopOut:
        out = value[std::size_t(r.node(n.args[0]).args[std::size_t(n.index)])];
        break;
      default:
        for (std::size_t c = 0; c < 3; ++c) {
          // A real is grey.
          if (c > 0 && n.type != ExprType::Color) {
            out[c] = out[0];
            continue;
          }
          T a[3] = {};
          for (std::size_t i = 0; i < n.args.size(); ++i) a[i] = arg(i)[c];
          out[c] = execute(n.op, a);
        }
    }
  };
  std::map<int, std::vector<std::array<T, 3>>> loop_results;
  for (int id = 0; id < r.size(); ++id) {
    const ExprNode& n = r.node(id);
    if (!seen[std::size_t(id)] || n.scope >= 0) continue;
    if (n.op == Op::LoopOut) {
      value[std::size_t(id)] = loop_results.at(n.args[0])[std::size_t(n.index)];
      continue;
    }
    if (n.op != Op::Loop) {
      compute(id);
      continue;
    }
    const std::size_t size = n.args.size() / 2;
    const int serial = int(n.value[0]);
    std::vector<std::array<T, 3>> state;
    for (std::size_t k = 0; k < size; ++k) state.push_back(value[std::size_t(n.args[k])]);
    for (int i = 0; i < n.index; ++i) {
      for (int body = 0; body < id; ++body) {
        const ExprNode& b = r.node(body);
        if (b.scope != serial || !seen[std::size_t(body)]) continue;
        if (b.op == Op::LoopVar)
          value[std::size_t(body)] = state[std::size_t(b.index)];
        else
          compute(body);
      }
      for (std::size_t k = 0; k < size; ++k) state[k] = value[std::size_t(n.args[size + k])];
    }
    loop_results[id] = std::move(state);
  }
  std::map<std::string, std::array<T, 3>> result;
  for (const auto& [name, id] : outputs_) result[name] = value[std::size_t(id)];
  return result;
}
template std::map<std::string, std::array<float, 3>> Program::run(const Inputs<float>&) const;
template std::map<std::string, std::array<double, 3>> Program::run(const Inputs<double>&) const;

}  // namespace brdfc::inline trace
