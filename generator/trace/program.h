// SPDX-License-Identifier: GPL-3.0-or-later
// What a recording is for: outputs, the nodes that these reach, and their execution.
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

/// The outputs of a recording: names and the nodes that give them.
class Program {
 public:
  void output(const std::string& name, const Expr& value) { outputs_.push_back({name, value.id()}); }
  void output(const std::string& name, const Rgb<Expr>& value) { outputs_.push_back({name, value.id()}); }

  /// name_x, name_y and name_z.
  void output(const std::string& name, const Vec3<Expr>& value) {
    output(name + "_x", value.x);
    output(name + "_y", value.y);
    output(name + "_z", value.z);
  }

  /// In the order in which they were named.
  const std::vector<std::pair<std::string, int>>& outputs() const { return outputs_; }
  /// By node of the current recorder, which must be the one the outputs were recorded with.
  const std::vector<bool>& reachable() const;
  /// Operations the outputs reach: what the shader executes, selections with both arms.
  int operations() const;
  /// Names of the inputs the outputs depend on.
  std::vector<std::string> inputs() const;
  /// Executes the recording in T: outputs by name. A missing input throws ExprError.
  template <class T> std::map<std::string, std::array<T, 3>> run(const Inputs<T>&) const;

 private:
  std::vector<std::pair<std::string, int>> outputs_;
  mutable std::vector<bool> reachable_;  // of the first so many outputs
  mutable std::size_t outputs_seen_ = 0;
};

}  // namespace brdfc::inline trace
