// SPDX-License-Identifier: GPL-3.0-or-later
// A light tree. The time to choose one of many lamps, or to find those that a ray meets, grows with the logarithm of
// their number.
//
// Choosing a lamp descends from the root. At each node a child is chosen with a probability proportional to the
// possible contribution of the lamps below it (A. Conty Estevez, C. Kulla: Importance Sampling of Many Lights with
// Adaptive Tree Splitting, PACM CGIT 1(2), 2018). Nodes have eight children, whose weights are computed together in
// vector instructions. The probability of a lamp is the product of the probabilities on the path to it. It can be
// computed again, identical to the last bit, for a lamp that a ray has met.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "core/vec.h"
#include "core/vectorised.h"

namespace brdfc::reference {

/// Bounds of a lamp or of a set of lamps.
struct LampBounds {
  Vec3<double> centre;      ///< for a distant lamp: the unit vector towards it
  double radius = 0;        ///< radius of a sphere about the centre that contains all of it
  Vec3<double> direction;   ///< unit vector: axis of the cone that contains the normals of the emitting surfaces
  double cos_cone = -1;     ///< cosine of the cone's half angle; -1: emits in all directions
  double power = 0;         ///< irradiance at distance 1 on a surface facing it; for a distant lamp at any distance
  bool far = false;         ///< a distant lamp, in the same direction from everywhere
  bool can_be_met = false;  ///< whether rays can meet it
};

class LightTree {
 public:
  static constexpr std::size_t kWidth = 8;
  /// Builds a tree of at least one lamp.
  explicit LightTree(std::span<const LampBounds> lamps);

  /// Computes the weights of the root's kWidth children for a surface point with this normal. Returns their sum, which
  /// is approximately the irradiance there; it is 0 if no lamp can contribute.
  double weigh_root(const Vec3<double>& p, const Vec3<double>& normal, double* root) const {
    return weigh(nodes_[0], p, normal, root);
  }

  struct Choice {
    std::size_t lamp = 0;
    double chance = 0;  ///< 0: no lamp was chosen
  };
  /// Chooses a lamp with u in [0, 1). `root` are the weights of weigh_root(), whose sum must not be 0.
  Choice choose(const Vec3<double>& p, const Vec3<double>& normal, const double* root, double u) const {
    double below[kWidth];
    const double* weights = root;
    Choice out{0, 1};
    for (std::size_t node = 0;;) {
      double sum = 0;
      for (std::size_t k = 0; k < kWidth; ++k) sum += weights[k];
      // A child with a weight may contain only lamps without weight, since bounds are wider than their contents.
      if (!(sum > 0)) return {};
      double left = u * sum;
      std::size_t k = 0, last = 0;
      for (; k < kWidth; ++k) {
        if (!(weights[k] > 0)) continue;
        last = k;
        if (left < weights[k]) break;
        left -= weights[k];
      }
      if (k == kWidth) k = last;  // because of rounding
      out.chance *= weights[k] / sum;
      const int next = nodes_[node].next[k];
      if (next < 0) {
        out.lamp = std::size_t(~next);
        return out;
      }
      u = left / weights[k];
      if (!(u < 1)) u = 0x1.fffffffffffffp-1;
      node = std::size_t(next);
      weigh(nodes_[node], p, normal, below);
      weights = below;
    }
  }
  /// The probability that choose() returns the lamp.
  double chance(std::size_t lamp, const Vec3<double>& p, const Vec3<double>& normal, const double* root) const {
    double below[kWidth];
    double out = 1;
    for (Place at = places_[lamp];; at = parents_[at.node]) {
      if (at.node) weigh(nodes_[at.node], p, normal, below);
      const double* weights = at.node ? below : root;
      double sum = 0;
      for (std::size_t k = 0; k < kWidth; ++k) sum += weights[k];
      if (!(weights[at.child] > 0)) return 0;
      out *= weights[at.child] / sum;
      if (!at.node) return out;
    }
  }

  /// Adds to `lamps` all lamps that a ray may meet before this distance, and possibly some more. Their order depends
  /// only on the ray. `direction` is a unit vector.
  void meet(const Vec3<double>& origin, const Vec3<double>& direction, double distance,
            std::vector<std::size_t>& lamps) const {
    if (!can_be_met_) return;
    std::array<int, kMostDeep * kWidth> stack;
    std::size_t size = 0;
    double passes[kWidth];
    for (std::size_t node = 0;;) {
      const Node& n = nodes_[node];
      pass(n, origin, direction, distance, passes);
      for (std::size_t k = 0; k < kWidth; ++k) {
        if (passes[k] == 0) continue;
        if (n.next[k] < 0)
          lamps.push_back(std::size_t(~n.next[k]));
        else
          stack[size++] = n.next[k];
      }
      if (size == 0) return;
      node = std::size_t(stack[--size]);
    }
  }

 private:
  /// Largest depth, which the builder ensures.
  static constexpr std::size_t kMostDeep = 64;

  template <class T> using Children = std::array<T, kWidth>;
  struct alignas(64) Node {
    Children<double> x{}, y{}, z{}, radius{};  // bounds
    Children<double> to_x{}, to_y{}, to_z{}, cos_cone{}, sin_cone{};
    Children<double> power{};       // 0: there is no such child
    Children<double> near{};        // 1, or 0 for distant lamps
    Children<double> met_radius{};  // radius with a margin for rounding; below 0: can't be met
    Children<int> next{};           // node, or ~lamp
  };
  struct Place {
    std::size_t node = 0, child = 0;
  };

  /// Computes the weight of each child and returns their sum. A child that can contribute has a weight above 0.
  static double weigh(const Node& n, const Vec3<double>& p, const Vec3<double>& normal, double* weights) {
    BRDFC_INDEPENDENT
    for (std::size_t k = 0; k < kWidth; ++k) {
      const double dx = n.x[k] - n.near[k] * p.x, dy = n.y[k] - n.near[k] * p.y, dz = n.z[k] - n.near[k] * p.z;
      const double r = n.radius[k];
      const double inverse = 1 / std::sqrt(maximum(maximum(dx * dx + dy * dy + dz * dz, r * r), kTiny));
      // Let s be the sine of the angular radius of the bounds, and x a cosine. Then x + s is 0 where the cosine of x's
      // angle reduced by the angular radius is, and for x > 0 an upper bound for it.
      const double s = r * inverse;
      const double cos_i = (dx * normal.x + dy * normal.y + dz * normal.z) * inverse;
      // The shading normal may differ from this normal, so lamps near the horizon keep some weight.
      const double receives = cos_i + s > 0 ? minimum(maximum(cos_i + s, kLeastCosine), 1.0) : 0.0;
      // The angle between the direction to the point and the nearest normal of the emitting surfaces.
      const double cos_w = -(dx * n.to_x[k] + dy * n.to_y[k] + dz * n.to_z[k]) * inverse,
                   sin_w = std::sqrt(maximum(1 - cos_w * cos_w, 0.0));
      const double cos_e = cos_w >= n.cos_cone[k] ? 1 : cos_w * n.cos_cone[k] + sin_w * n.sin_cone[k];
      const double sends = minimum(maximum(cos_e + s, 0.0), 1.0);
      weights[k] = n.power[k] * receives * sends * (n.near[k] > 0 ? inverse * inverse : 1.0);
    }
    double sum = 0;
    for (std::size_t k = 0; k < kWidth; ++k) sum += weights[k];
    return sum;
  }

  /// Sets `passes` to 1 for each child whose bounds the ray meets, and to 0 for the others.
  static void pass(const Node& n, const Vec3<double>& o, const Vec3<double>& w, double distance, double* passes) {
    // Distant lamps count as lamps at distance 1, and are met only by rays without a limit.
    const double far_limit = distance >= kNever ? kNever : -kNever;
    BRDFC_INDEPENDENT
    for (std::size_t k = 0; k < kWidth; ++k) {
      const double dx = n.x[k] - n.near[k] * o.x, dy = n.y[k] - n.near[k] * o.y, dz = n.z[k] - n.near[k] * o.z;
      const double r = n.met_radius[k], limit = n.near[k] > 0 ? distance : far_limit;
      const double along = n.near[k] > 0 ? dx * w.x + dy * w.y + dz * w.z : 1.0;
      const double ax = dx - w.x * along, ay = dy - w.y * along, az = dz - w.z * along;
      double meets = ax * ax + ay * ay + az * az <= r * r ? 1.0 : 0.0;
      meets = along > -r ? meets : 0.0;
      meets = along - r < limit ? meets : 0.0;
      passes[k] = r >= 0 ? meets : 0.0;
    }
  }

  static constexpr double kLeastCosine = 0.05, kTiny = 1e-60;
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  struct Builder;

  std::vector<Node> nodes_;     // the first one is the root
  std::vector<Place> parents_;  // by node; that of the root is not used
  std::vector<Place> places_;   // by lamp
  bool can_be_met_ = false;
};

}  // namespace brdfc::reference
