// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/gaps.h"

#include <cmath>

namespace brdfc::measured {
namespace {

/// A line of entries along an axis.
struct Line {
  std::size_t first, stride;
  std::size_t entry(std::size_t k) const { return first + k * stride; }
};

/// Whether an entry was filled, and whether one is left that could not be.
struct Done {
  bool some = false, left = false;
};

void fill_line(std::vector<std::array<float, 3>>& values, const AngleAxis& axis, const Line& line,
               const std::vector<bool>& above, Done& done) {
  AngleAxis known{{}, axis.ends};
  std::vector<std::size_t> from, gaps;
  for (std::size_t k = 0; k < axis.at.size(); ++k) {
    const std::size_t entry = line.entry(k);
    if (!above[entry]) continue;
    if (std::isnan(values[entry][0])) {
      gaps.push_back(k);
    } else {
      known.at.push_back(axis.at[k]);
      from.push_back(entry);
    }
  }
  if (gaps.empty()) return;
  (from.empty() ? done.left : done.some) = true;
  if (from.empty()) return;
  for (const std::size_t k : gaps) {
    const auto [first, second, weight] = known.locate(axis.at[k]);
    for (std::size_t c = 0; c < 3; ++c)
      values[line.entry(k)][c] =
          float((1 - weight) * double(values[from[first]][c]) + weight * double(values[from[second]][c]));
  }
}

}  // namespace

void fill_gaps(std::vector<std::array<float, 3>>& values, std::span<const AngleAxis* const> axes,
               std::span<const std::size_t> order, const std::vector<bool>& above) {
  Done done;
  // Once around is enough, unless whole planes have nothing.
  do {
    done = {};
    for (const std::size_t along : order) {
      std::size_t stride = 1;
      for (std::size_t k = along + 1; k < axes.size(); ++k) stride *= axes[k]->at.size();
      const std::size_t block = stride * axes[along]->at.size();
      done.left = false;
      for (std::size_t begin = 0; begin < values.size(); begin += block)
        for (std::size_t i = 0; i < stride; ++i) fill_line(values, *axes[along], {begin + i, stride}, above, done);
    }
  } while (done.some && done.left);
}

}  // namespace brdfc::measured
