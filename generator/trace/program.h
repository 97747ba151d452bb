// SPDX-License-Identifier: GPL-3.0-or-later
// What a recording is for: outputs, the nodes that these reach, and their execution. A program owns its nodes, so that
// it may be kept, printed and run after its recorder is gone.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "trace/expr.h"

namespace brdfc::inline trace {

/// Values by the names of inputs; a real is grey.
template <class T> using Inputs = std::map<std::string, std::array<T, 3>>;
template <class T> void set_input(Inputs<T>& inputs, const std::string& name, double v) {
  inputs[name] = {T(v), T(v), T(v)};
}
/// Those of input3().
template <class T, class S> void set_input(Inputs<T>& inputs, const std::string& name, const Vec3<S>& v) {
  set_input(inputs, name + "_x", v.x);
  set_input(inputs, name + "_y", v.y);
  set_input(inputs, name + "_z", v.z);
}

/// The outputs of a recording: names and the nodes that give them. While it is made, the recorder of its values must be
/// the current one; to read it, print it or run it takes none.
class Program {
 public:
  /// Throws ExprError if the values of two recorders are given to one program.
  void output(const std::string& name, const Expr& value) { add(name, value.id()); }
  void output(const std::string& name, const Rgb<Expr>& value) { add(name, value.id()); }

  /// name_x, name_y and name_z.
  void output(const std::string& name, const Vec3<Expr>& value) {
    output(name + "_x", value.x);
    output(name + "_y", value.y);
    output(name + "_z", value.z);
  }

  /// In the order in which they were named.
  const std::vector<std::pair<std::string, int>>& outputs() const { return outputs_; }
  /// Nodes have the numbers that they have in the recorder, arguments smaller ones. Those from 0 to size() - 1 that are
  /// reachable() are there.
  int size() const { return int(nodes_.size()); }
  const ExprNode& node(int id) const { return nodes_[std::size_t(id)]; }
  /// By node: whether an output depends on it.
  const std::vector<bool>& reachable() const { return reachable_; }
  /// Operations the outputs reach: what the shader executes, selections with both arms.
  int operations() const;
  /// Names of the inputs the outputs depend on.
  std::vector<std::string> inputs() const;
  /// Executes the recording in T: outputs by name. A missing input throws ExprError.
  template <class T> std::map<std::string, std::array<T, 3>> run(const Inputs<T>&) const;

 private:
  void add(const std::string& name, int id);

  std::vector<std::pair<std::string, int>> outputs_;
  std::vector<ExprNode> nodes_;
  std::vector<bool> reachable_;
  const Recorder* recorder_ = nullptr;  // never followed: it may be gone
};

/// Whether they have the same outputs, of the same operations on the same inputs, with the same names. In which order
/// these were recorded makes no difference.
bool operator==(const Program&, const Program&);

}  // namespace brdfc::inline trace
