// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as a list of Blender's Math, Vector Math and Mix nodes, which Cycles' SVM runs on every device.
//
// A real is a float, a colour a vector, a truth value 0 or 1. SVM has no loops, so they are unrolled; no expm1 and
// log1p, so those are series (core/series.h). Its division is 0 where the divisor is 0, its square root 0 and its
// logarithm 0 where they are not defined, a power of a negative base 0 unless the exponent is whole: formulas guard
// their arguments, so none of this shows. An arm of a selection that is not taken is multiplied by 0, so it has to be
// finite.
#pragma once

#include <array>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// What a node takes: a constant, an input or the result of an earlier node.
struct NodeOperand {
  int result = -1;                ///< number of that node
  std::string input;              ///< "": none
  std::array<double, 3> value{};  ///< of a constant
  bool color = false;             ///< whether it is a vector

  bool is_constant() const { return result < 0 && input.empty(); }
  bool operator==(const NodeOperand&) const = default;
};

struct NodeOperation {
  /// The operation of a Math node, as Blender calls it; with V_ before it that of a Vector Math node; MIX and V_MIX, of
  /// a factor and the values at 0 and 1; COMBINE, of x, y, z; X, Y, Z, of a vector; LOOKUP, of coordinates from 0 to 1.
  std::string kind;
  std::vector<NodeOperand> operands;
  bool color = false;                    ///< whether the result is a vector
  std::shared_ptr<const Table> table{};  ///< of a LOOKUP
};

struct NodeProgram {
  std::vector<std::pair<std::string, bool>> inputs;  ///< names, and which are vectors
  std::vector<NodeOperation> operations;             ///< each after those whose results it takes
  std::vector<std::pair<std::string, NodeOperand>> outputs;
  /// Floats of results that are alive at once, at most, if nodes run in this order: SVM's stack has 255.
  int live = 0;
};

/// SVM's stack, in floats.
inline constexpr int kSvmStack = 255;

/// Whether nodes can be made of a program: a table of one axis becomes a polynomial, if it is smooth; of others they
/// have none.
bool has_nodes(const Program&);

/// There has to be a recorder, whose precision constants are folded in. Inputs and outputs NAME_x, NAME_y and NAME_z,
/// for a name among `vectors`, are one vector NAME: sums, products with numbers and dot products of vectors are one
/// node each.
NodeProgram node_program(const Program&, const std::set<std::string>& vectors = {});

/// The same in two steps, where a program runs several times with the same values of all inputs but some.
struct NodePrograms {
  NodeProgram once;  ///< what does not depend on the varying inputs; outputs that are inputs of `each`
  NodeProgram each;
};
/// `prefix`: names of what goes from one to the other begin with it.
NodePrograms node_programs(const Program&, const std::set<std::string>& varying, const std::string& prefix,
                           const std::set<std::string>& vectors = {});

}  // namespace brdfc::print
