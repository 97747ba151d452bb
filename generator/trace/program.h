// SPDX-License-Identifier: GPL-3.0-or-later
// The result of a recording: outputs, the nodes that they depend on, and the execution of these. A program owns its
// nodes, so it can be stored, printed and run after its recorder is gone.
#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "trace/expr.h"

namespace brdfc::inline trace {

/// Values by input name; a real used as a colour is grey.
template <class T> using Inputs = std::map<std::string, std::array<T, 3>>;
template <class T> void set_input(Inputs<T>& inputs, const std::string& name, double v) {
  inputs[name] = {T(v), T(v), T(v)};
}
/// Sets the three inputs of input3().
template <class T, class S> void set_input(Inputs<T>& inputs, const std::string& name, const Vec3<S>& v) {
  set_input(inputs, name + "_x", v.x);
  set_input(inputs, name + "_y", v.y);
  set_input(inputs, name + "_z", v.z);
}

/// The outputs of a recording: their names and nodes. The recorder of the values must be current while outputs are
/// added; reading, printing and running the program needs no recorder.
class Program {
 public:
  /// Throws ExprError if one program gets values of two recorders.
  void output(const std::string& name, const Expr& value) { add(name, value.id()); }
  void output(const std::string& name, const Rgb<Expr>& value) { add(name, value.id()); }

  /// Adds the outputs name_x, name_y and name_z.
  void output(const std::string& name, const Vec3<Expr>& value) {
    output(name + "_x", value.x);
    output(name + "_y", value.y);
    output(name + "_z", value.z);
  }

  /// The outputs, in the order in which they were added.
  const std::vector<std::pair<std::string, int>>& outputs() const { return outputs_; }
  /// Nodes keep the numbers that they have in the recorder, so arguments have smaller numbers. Of the numbers from 0 to
  /// size() - 1, only those that are reachable() are valid.
  int size() const { return int(nodes_.size()); }
  const ExprNode& node(int id) const { return nodes_[std::size_t(id)]; }
  /// For each node: true if an output depends on it.
  const std::vector<bool>& reachable() const { return reachable_; }
  /// The number of operations that outputs depend on: what the shader executes, with both arms of selections.
  int operations() const;
  /// The names of the inputs that the outputs depend on.
  std::vector<std::string> inputs() const;
  /// Runs the program in T and returns the outputs by name. Throws ExprError if an input is missing.
  template <class T> std::map<std::string, std::array<T, 3>> run(const Inputs<T>&) const;

 private:
  void add(const std::string& name, int id);

  std::vector<std::pair<std::string, int>> outputs_;
  std::vector<ExprNode> nodes_;
  std::vector<bool> reachable_;
  const Recorder* recorder_ = nullptr;  // never dereferenced: the recorder may be gone
};

/// True if both programs have the same outputs, computed by the same operations from inputs with the same names. The
/// order in which the operations were recorded makes no difference.
bool operator==(const Program&, const Program&);

}  // namespace brdfc::inline trace
