// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/tensor_tree.h"

#include <algorithm>
#include <numbers>

#include "measured/measurement.h"

namespace brdfc::measured {
namespace {

/// Halvings along a dimension. Radiance's programs make up to eight.
constexpr int kDeepest = 16;

}  // namespace

TensorTree::TensorTree(NumberText text, std::size_t dimensions) : dimensions_(dimensions), nodes_(1) {
  read(0, 0, text);
  if (text.peek()) input_error("{}: expected nothing after the closing brace, found '{}'", text.where(), text.rest());
}

void TensorTree::read(std::size_t node, int depth, NumberText& text) {
  const auto brace = [&](char c) {
    if (!text.take(c))
      input_error("{}: expected '{}' after {}, found {}", text.where(), c, counted(values_.size(), "number", "numbers"),
                  text.peek() ? fmt::format("'{}'", text.rest()) : "the end: truncated?");
  };
  brace('{');
  if (text.peek() == '{') {
    if (depth == kDeepest)
      input_error("{}: expected at most {} braces in each other, found more", text.where(), kDeepest + 1);
    const std::size_t first = nodes_.size(), children = std::size_t(1) << dimensions_;
    nodes_[node].first = first;
    nodes_.resize(first + children);
    for (std::size_t i = 0; i < children; ++i) read(first + i, depth + 1, text);
  } else {
    const std::size_t first = values_.size();
    const auto place = [&] { return fmt::format("number {}", values_.size() + 1); };
    while (text.peek() && text.peek() != '}') {
      const float value = text.number(place);
      negative_ += value < 0;
      values_.push_back(std::max(value, 0.f));
    }
    const std::size_t count = values_.size() - first;
    int log2 = 0;
    while (std::size_t(1) << (std::size_t(log2) * dimensions_) < count) ++log2;
    if (std::size_t(1) << (std::size_t(log2) * dimensions_) != count)
      input_error("{}: expected 1, {}, {} or so numbers in braces, n x n{} cells, found {}", text.where(),
                  1 << dimensions_, 1 << (2 * dimensions_), dimensions_ == 3 ? " x n" : " x n x n", count);
    nodes_[node] = {first, log2};
    finest_ = std::max(finest_, depth + log2);
  }
  brace('}');
}

float TensorTree::at(const Place& place) const {
  Place p = place;
  const Node* node = nodes_.data();
  while (node->log2 < 0) {
    std::size_t child = 0;
    for (std::size_t d = 0; d < dimensions_; ++d) {
      p[d] *= 2;
      if (p[d] >= 1) child |= std::size_t(1) << d, p[d] -= 1;
    }
    node = &nodes_[node->first + child];
  }
  const std::size_t cells = std::size_t(1) << node->log2;
  std::size_t cell = 0;
  for (std::size_t d = 0; d < dimensions_; ++d)
    cell = cell * cells + std::min(std::size_t(std::max(p[d], 0.) * double(cells)), cells - 1);
  return values_[node->first + cell];
}

void TensorTree::for_each(const std::function<void(const Place&, float)>& call) const { visit(nodes_[0], {}, 1, call); }

void TensorTree::visit(const Node& node, const Place& corner, double width,
                       const std::function<void(const Place&, float)>& call) const {
  if (node.log2 < 0) {
    for (std::size_t child = 0; child < std::size_t(1) << dimensions_; ++child) {
      Place at = corner;
      for (std::size_t d = 0; d < dimensions_; ++d) at[d] += (child >> d & 1) ? width / 2 : 0;
      visit(nodes_[node.first + child], at, width / 2, call);
    }
    return;
  }
  const std::size_t cells = std::size_t(1) << node.log2, count = std::size_t(1)
                                                                 << (std::size_t(node.log2) * dimensions_);
  for (std::size_t i = 0; i < count; ++i) {
    Place at = corner;
    std::size_t rest = i;
    for (std::size_t d = dimensions_; d-- > 0; rest /= cells)
      at[d] += width * (double(rest % cells) + 0.5) / double(cells);
    call(at, values_[node.first + i]);
  }
}

float TensorTree::largest() const { return values_.empty() ? 0 : *std::ranges::max_element(values_); }

std::array<double, 2> square_of_disk(double x, double y) {
  constexpr double kQuarter = std::numbers::pi / 4;
  const double r = std::min(std::hypot(x, y), 1.);
  double phi = std::atan2(y, x);
  if (phi < -kQuarter) phi += 8 * kQuarter;
  double a = 0, b = 0;
  if (phi < kQuarter)
    a = r, b = r * phi / kQuarter;
  else if (phi < 3 * kQuarter)
    b = r, a = r * (2 - phi / kQuarter);
  else if (phi < 5 * kQuarter)
    a = -r, b = r * (4 - phi / kQuarter);
  else
    b = -r, a = r * (phi / kQuarter - 6);
  return {(a + 1) / 2, (b + 1) / 2};
}

}  // namespace brdfc::measured
