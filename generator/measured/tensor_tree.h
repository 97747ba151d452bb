// SPDX-License-Identifier: GPL-3.0-or-later
// Radiance's tensor trees: a BRDF in cells of several sizes (G. Ward, M. Kurt, N. Bonneel: Reducing Anisotropic BSDF
// Measurement to Common Practice, Workshop on Material Appearance Modeling, 2014; src/common/bsdf_t.c).
//
// A text of nested braces: a node has 2^n nodes, n the number of dimensions, or numbers on a grid of 2^k cells along
// each. Bit d of a node's number says in which half of dimension d it is; of grids the last dimension runs fastest.
// Dimensions are coordinates of the unit square to which P. Shirley's and K. Chiu's map (A Low Distortion Map Between
// Disk and Square, 1997) takes the projections of directions, so cells have equal projected solid angles. A number is
// the mean over its cell.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "measured/number_text.h"

namespace brdfc::measured {

class TensorTree {
 public:
  /// Coordinates from 0 to 1, of which a tree uses the first ones.
  using Place = std::array<double, 4>;

  /// Throws InputError for a text that is not a tree with this number of dimensions, which is 3 or 4.
  TensorTree(NumberText text, std::size_t dimensions);
  float at(const Place&) const;
  /// Calls for the centre of each cell, with its number.
  void for_each(const std::function<void(const Place&, float)>&) const;
  std::size_t size() const { return values_.size(); }
  std::size_t negative() const { return negative_; }
  /// Cells along a dimension where they are smallest.
  std::size_t finest() const { return std::size_t(1) << finest_; }
  float largest() const;

 private:
  struct Node {
    std::size_t first = 0;  ///< of its nodes, or of its values
    int log2 = -1;          ///< of the cells along a dimension; -1: it has nodes
  };
  void read(std::size_t node, int depth, NumberText&);
  void visit(const Node&, const Place& corner, double width, const std::function<void(const Place&, float)>&) const;

  std::size_t dimensions_;
  std::vector<Node> nodes_;
  std::vector<float> values_;
  std::size_t negative_ = 0;
  int finest_ = 0;
};

/// Where a point of the unit disk is in the unit square.
std::array<double, 2> square_of_disk(double x, double y);

}  // namespace brdfc::measured
