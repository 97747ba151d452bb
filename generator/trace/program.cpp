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

bool equal(const Table& a, const Table& b) {
  return a.name == b.name && a.axes == b.axes && a.channels == b.channels && a.values == b.values;
}

}  // namespace

void Program::add(const std::string& name, int id) {
  const Recorder& r = Recorder::current();
  if (recorder_ && recorder_ != &r) throw ExprError("a program of two Recorders");
  recorder_ = &r;
  outputs_.push_back({name, id});
  if (id >= size()) {
    nodes_.resize(std::size_t(id) + 1);
    reachable_.resize(std::size_t(id) + 1);
  }
  std::vector<int> stack = {id};
  while (!stack.empty()) {
    const auto at = std::size_t(stack.back());
    stack.pop_back();
    if (reachable_[at]) continue;
    reachable_[at] = true;
    nodes_[at] = r.node(int(at));
    stack.insert(stack.end(), nodes_[at].args.begin(), nodes_[at].args.end());
  }
  // A formula may have named a node since it was copied.
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    if (reachable_[i] && nodes_[i].hint.empty()) nodes_[i].hint = r.node(int(i)).hint;
}

int Program::operations() const {
  int count = 0;
  for (int id = 0; id < size(); ++id) {
    const Op op = node(id).op;
    if (reachable_[std::size_t(id)] && op != Op::Const && op != Op::Input && op != Op::LoopVar && op != Op::LoopOut)
      ++count;
  }
  return count;
}

std::vector<std::string> Program::inputs() const {
  std::vector<std::string> names;
  for (int id = 0; id < size(); ++id)
    if (reachable_[std::size_t(id)] && node(id).op == Op::Input) names.push_back(node(id).name);
  return names;
}

bool operator==(const Program& a, const Program& b) {
  if (a.outputs().size() != b.outputs().size()) return false;
  // Maps nodes and loops of each program to those of the other.
  std::map<int, int> there, back, loop_there, loop_back;
  std::vector<std::pair<int, int>> unseen;
  const auto one_to_one = [](std::map<int, int>& to, std::map<int, int>& from, int x, int y) {
    return to.emplace(x, y).first->second == y && from.emplace(y, x).first->second == x;
  };
  const auto pair = [&](int x, int y) {
    if (!there.count(x)) unseen.push_back({x, y});
    return one_to_one(there, back, x, y);
  };
  const auto pair_loops = [&](int x, int y) { return one_to_one(loop_there, loop_back, x, y); };
  for (std::size_t i = 0; i < a.outputs().size(); ++i)
    if (a.outputs()[i].first != b.outputs()[i].first || !pair(a.outputs()[i].second, b.outputs()[i].second))
      return false;
  while (!unseen.empty()) {
    const auto [x, y] = unseen.back();
    unseen.pop_back();
    const ExprNode &m = a.node(x), &n = b.node(y);
    if (m.op != n.op || m.type != n.type || m.name != n.name || m.index != n.index || m.hint != n.hint ||
        m.args.size() != n.args.size() || !pair_loops(m.scope, n.scope))
      return false;
    // The value of a Loop node is its serial.
    if (m.op == Op::Loop ? !pair_loops(int(m.value[0]), int(n.value[0])) : m.value != n.value) return false;
    if (m.op == Op::Lookup && m.table != n.table && !equal(*m.table, *n.table)) return false;
    for (std::size_t k = 0; k < m.args.size(); ++k)
      if (!pair(m.args[k], n.args[k])) return false;
  }
  return true;
}

template <class T> std::map<std::string, std::array<T, 3>> Program::run(const Inputs<T>& inputs) const {
  const std::vector<bool>& seen = reachable();
  std::vector<std::array<T, 3>> value(nodes_.size());
  const auto compute = [&](int id) {
    const ExprNode& n = node(id);
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
        break;  // set by its loop
      case Op::LoopOut:
        out = value[std::size_t(node(n.args[0]).args[std::size_t(n.index)])];
        break;
      default:
        for (std::size_t c = 0; c < 3; ++c) {
          // A real used as a colour is grey.
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
  for (int id = 0; id < size(); ++id) {
    const ExprNode& n = node(id);
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
        const ExprNode& b = node(body);
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
