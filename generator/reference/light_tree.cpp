// SPDX-License-Identifier: GPL-3.0-or-later
#include "reference/light_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace brdfc::reference {
namespace {

using Vector = Vec3<double>;

struct Box {
  Vector low{kInf, kInf, kInf}, high{-kInf, -kInf, -kInf};
  static constexpr double kInf = std::numeric_limits<double>::infinity();
  void add(const LampBounds& lamp) {
    const Vector& c = lamp.centre;
    const double r = lamp.radius;
    low = {std::min(low.x, c.x - r), std::min(low.y, c.y - r), std::min(low.z, c.z - r)};
    high = {std::max(high.x, c.x + r), std::max(high.y, c.y + r), std::max(high.z, c.z + r)};
  }
  Vector centre() const { return (low + high) * 0.5; }
  double diagonal2() const { return dot(high - low, high - low); }
};

/// The coordinates by which sets of lamps are divided: three of the position and three of the direction.
constexpr int kCoordinates = 6;
double coordinate(const LampBounds& lamp, int which) {
  const Vector& v = which < 3 ? lamp.centre : lamp.direction;
  return which % 3 == 0 ? v.x : which % 3 == 1 ? v.y : v.z;
}

}  // namespace

struct LightTree::Builder {
  using Set = std::span<std::size_t>;  // indices of lamps

  std::span<const LampBounds> lamps;
  LightTree& tree;

  /// Bounds of lamps that are either all near or all far.
  LampBounds bounds(Set set) const {
    if (set.size() == 1) return lamps[set[0]];
    LampBounds out;
    Box box;
    Vector axis{0, 0, 0};
    double least_cos = 1;
    for (const std::size_t i : set) {
      const LampBounds& lamp = lamps[i];
      box.add(lamp);
      axis = axis + lamp.direction;
      least_cos = std::min(least_cos, lamp.cos_cone);
      out.power += lamp.power;
      out.can_be_met |= lamp.can_be_met;
    }
    out.far = lamps[set[0]].far;
    out.centre = box.centre();
    for (const std::size_t i : set)
      out.radius = std::max(out.radius, length(lamps[i].centre - out.centre) + lamps[i].radius);
    if (least_cos > 0 && length(axis) > 1e-6) {
      out.direction = normalize(axis);
      // A margin for acos(), which is inaccurate near 1.
      double widest = 0;
      for (const std::size_t i : set)
        widest = std::max(widest, std::acos(std::clamp(dot(out.direction, lamps[i].direction), -1.0, 1.0)) +
                                      std::acos(lamps[i].cos_cone));
      out.cos_cone = std::cos(std::min(widest + 1e-7, kPi));
    }
    return out;
  }

  /// The loss of accuracy if lamps with these bounds are sampled as one.
  static double cost(const Box& box, double power, const Vector& directions, std::size_t count, bool all_ways) {
    // The length of the mean of unit vectors is 1 if they are equal.
    const double spread = all_ways ? 1 : 1 - length(directions) / double(count);
    return power * (box.diagonal2() + 1e-30) * (1 + 2 * spread);
  }

  /// Divides a set of at least two lamps into two sets.
  std::array<Set, 2> divide(Set set) const {
    constexpr int kBuckets = 16;
    struct Bucket {
      Box box;
      double power = 0;
      Vector directions{0};
      std::size_t count = 0;
      bool all_ways = false;
      void add(const LampBounds& lamp) {
        box.add(lamp);
        power += lamp.power;
        directions = directions + lamp.direction;
        ++count;
        all_ways |= lamp.cos_cone < 0;
      }
      void add(const Bucket& b) {
        if (!b.count) return;
        box.low = {std::min(box.low.x, b.box.low.x), std::min(box.low.y, b.box.low.y),
                   std::min(box.low.z, b.box.low.z)};
        box.high = {std::max(box.high.x, b.box.high.x), std::max(box.high.y, b.box.high.y),
                    std::max(box.high.z, b.box.high.z)};
        power += b.power;
        directions = directions + b.directions;
        count += b.count;
        all_ways |= b.all_ways;
      }
      double cost() const { return Builder::cost(box, power, directions, count, all_ways); }
    };
    double best = std::numeric_limits<double>::infinity();
    int best_coordinate = -1, best_bucket = 0;
    double best_low = 0, best_scale = 0;
    const auto bucket_of = [&](std::size_t lamp, int which, double low, double scale) {
      return std::clamp(int((coordinate(lamps[lamp], which) - low) * scale), 0, kBuckets - 1);
    };
    for (int which = 0; which < kCoordinates; ++which) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const std::size_t i : set) {
        low = std::min(low, coordinate(lamps[i], which));
        high = std::max(high, coordinate(lamps[i], which));
      }
      const double scale = kBuckets / (high - low);
      if (!(high > low) || !std::isfinite(scale)) continue;
      std::array<Bucket, kBuckets> buckets;
      for (const std::size_t i : set) buckets[std::size_t(bucket_of(i, which, low, scale))].add(lamps[i]);
      for (int at = 1; at < kBuckets; ++at) {
        Bucket left, right;
        for (int b = 0; b < kBuckets; ++b) (b < at ? left : right).add(buckets[std::size_t(b)]);
        if (!left.count || !right.count) continue;
        const double cost = left.cost() + right.cost();
        if (cost < best) best = cost, best_coordinate = which, best_bucket = at, best_low = low, best_scale = scale;
      }
    }
    std::size_t middle = set.size() / 2;  // equal lamps: any half will do
    if (best_coordinate >= 0)
      middle = std::size_t(std::partition(set.begin(), set.end(),
                                          [&](std::size_t i) {
                                            return bucket_of(i, best_coordinate, best_low, best_scale) < best_bucket;
                                          }) -
                           set.begin());
    return {set.first(middle), set.subspan(middle)};
  }

  /// Makes a node with the lamps in the sets, and returns its index. `depth` is the number of nodes above it.
  std::size_t node(std::vector<Set> sets, std::size_t depth) {
    // Near the bottom of a tree that is too deep, sets are halved regardless of where their lamps are.
    const bool halve = depth + 24 > kMostDeep;
    while (sets.size() < kWidth) {
      double most = -1;
      std::size_t chosen = sets.size();
      for (std::size_t i = 0; i < sets.size(); ++i) {
        if (sets[i].size() < 2) continue;
        const LampBounds b = bounds(sets[i]);
        const double loss = halve ? double(sets[i].size()) : b.power * b.radius * b.radius;
        if (loss > most) most = loss, chosen = i;
      }
      if (chosen == sets.size()) break;
      const Set set = sets[chosen];
      const auto [left, right] =
          halve ? std::array<Set, 2>{set.first(set.size() / 2), set.subspan(set.size() / 2)} : divide(set);
      sets[chosen] = left;
      sets.push_back(right);
    }
    const std::size_t index = tree.nodes_.size();
    tree.nodes_.emplace_back();
    tree.parents_.emplace_back();
    for (std::size_t k = 0; k < sets.size(); ++k) {
      int next;
      if (sets[k].size() == 1) {
        next = ~int(sets[k][0]);
        tree.places_[sets[k][0]] = {index, k};
      } else {
        const std::size_t child = node({sets[k]}, depth + 1);
        tree.parents_[child] = {index, k};
        next = int(child);
      }
      const LampBounds b = bounds(sets[k]);
      Node& n = tree.nodes_[index];
      n.next[k] = next;
      n.x[k] = b.centre.x, n.y[k] = b.centre.y, n.z[k] = b.centre.z;
      n.to_x[k] = b.direction.x, n.to_y[k] = b.direction.y, n.to_z[k] = b.direction.z;
      n.radius[k] = b.radius;
      n.cos_cone[k] = b.cos_cone;
      n.sin_cone[k] = std::sqrt(std::max(1 - b.cos_cone * b.cos_cone, 0.0));
      n.power[k] = b.power;
      n.near[k] = b.far ? 0 : 1;
      n.met_radius[k] = b.can_be_met ? b.radius * (1 + 1e-6) + 1e-9 * length(b.centre) : -1;
    }
    for (std::size_t k = sets.size(); k < kWidth; ++k) tree.nodes_[index].met_radius[k] = -1;
    return index;
  }
};

LightTree::LightTree(std::span<const LampBounds> lamps) : places_(lamps.size()) {
  std::vector<std::size_t> order(lamps.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto middle = std::stable_partition(order.begin(), order.end(), [&](std::size_t i) { return !lamps[i].far; });
  const std::size_t near = std::size_t(middle - order.begin());
  std::vector<Builder::Set> sets;
  const Builder::Set all(order);
  if (near > 0) sets.push_back(all.first(near));
  if (near < all.size()) sets.push_back(all.subspan(near));
  Builder{lamps, *this}.node(sets, 0);
  can_be_met_ = std::any_of(lamps.begin(), lamps.end(), [](const LampBounds& l) { return l.can_be_met; });
}

}  // namespace brdfc::reference
