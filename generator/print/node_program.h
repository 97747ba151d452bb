// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as a list of Blender's Math, Vector Math and Mix nodes, which run in Cycles' SVM on every device.
//
// A real is a float, a colour a vector, a truth value 0 or 1. SVM has no loops, so they are unrolled, and no expm1 and
// log1p, so they become series (core/series.h). Where a division, square root or logarithm is undefined, SVM gives 0,
// and so it does for a negative base with an exponent that is not an integer; formulas guard their arguments, so this
// does not matter. The branch of a selection that is not taken is multiplied by 0, so it has to be finite.
#pragma once

#include <array>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// An operand of a node: a constant, an input of the program, or the result of an earlier node.
struct NodeOperand {
  int result = -1;                ///< index of the earlier node
  std::string input;              ///< name of the input; empty if it is none
  std::array<double, 3> value{};  ///< of the constant
  bool color = false;             ///< true for a vector

  bool is_constant() const { return result < 0 && input.empty(); }
  bool operator==(const NodeOperand&) const = default;
};

struct NodeOperation {
  /// The name of the operation: that of Blender's Math node; with the prefix V_, that of a Vector Math node; MIX and
  /// V_MIX of a factor and the values at 0 and 1; COMBINE of x, y, z; X, Y, Z of a vector; LOOKUP of coordinates from 0
  /// to 1.
  std::string kind;
  std::vector<NodeOperand> operands;
  bool color = false;                    ///< true if the result is a vector
  std::shared_ptr<const Table> table{};  ///< for a LOOKUP
};

struct NodeProgram {
  std::vector<std::pair<std::string, bool>> inputs;  ///< names, and true for vectors
  std::vector<NodeOperation> operations;             ///< each one after those whose results it uses
  std::vector<std::pair<std::string, NodeOperand>> outputs;
  /// Maximum number of floats that are alive at once if nodes run in this order. SVM's stack has 255.
  int live = 0;
};

/// Size of SVM's stack, in floats.
inline constexpr int kSvmStack = 255;

/// True if the program can be made of nodes. Its tables must have one axis and be smooth, because nodes have no tables
/// and use polynomials instead.
bool has_nodes(const Program&);

/// Requires a current recorder, in whose precision constants are folded. For a name in `vectors`, the inputs or outputs
/// NAME_x, NAME_y and NAME_z become one vector NAME. Sums, dot products and products of vectors with numbers then take
/// one node each.
NodeProgram node_program(const Program&, const std::set<std::string>& vectors = {});

/// A program split into several, of which some run several times while only some of the inputs change.
struct NodePrograms {
  NodeProgram once;               ///< what does not depend on the varying inputs
  std::vector<NodeProgram> each;  ///< the rest, for each list of outputs; outputs of `once` are inputs
};
/// `outputs`: names of the program's outputs; those that none of the lists contains are left out. `prefix`: the names
/// of values passed from `once` begin with it.
NodePrograms node_programs(const Program&, const std::set<std::string>& varying, const std::string& prefix,
                           const std::vector<std::set<std::string>>& outputs,
                           const std::set<std::string>& vectors = {});

}  // namespace brdfc::print
