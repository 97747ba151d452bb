// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/cubature.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

namespace brdfc::measure {
namespace {

struct Cell {
  Rect rect;
  std::size_t slot;  // index of its value and error
  double worst;      // largest component of the error
  bool split_x;
};
struct Smaller {
  bool operator()(const Cell& a, const Cell& b) const { return a.worst < b.worst; }
};

// A. C. Genz and A. A. Malik, "An adaptive algorithm for numerical integration over an N-dimensional
// rectangular region", J. Comput. Appl. Math. 6 (1980), with N = 2.
class GenzMalik {
 public:
  GenzMalik(const Integrand2& f, std::size_t components) : f_(f), n_(components), values_(17 * components) {}

  /// Appends the cell's integrals and errors. Returns the entry for the queue.
  Cell apply(const Rect& r, std::vector<double>& integrals, std::vector<double>& errors) {
    const double l2 = std::sqrt(9. / 70), l3 = std::sqrt(9. / 10), l5 = std::sqrt(9. / 19);
    const double w1 = (12824. - 9120 * 2 + 400 * 4) / 19683, w2 = 980. / 6561, w3 = (1820. - 400 * 2) / 19683;
    const double w4 = 200. / 19683, w5 = 6859. / 19683 / 4;
    const double e1 = (729. - 950 * 2 + 50 * 4) / 729, e2 = 245. / 486, e3 = (265. - 100 * 2) / 1458, e4 = 25. / 729;
    const double cx = 0.5 * (r.x0 + r.x1), cy = 0.5 * (r.y0 + r.y1);
    const double hx = 0.5 * (r.x1 - r.x0), hy = 0.5 * (r.y1 - r.y0), area = 4 * hx * hy;
    const double nodes[17][2] = {{0, 0},   {-l2, 0},   {l2, 0},   {0, -l2},   {0, l2},   {-l3, 0},
                                 {l3, 0},  {0, -l3},   {0, l3},   {-l3, -l3}, {-l3, l3}, {l3, -l3},
                                 {l3, l3}, {-l5, -l5}, {-l5, l5}, {l5, -l5},  {l5, l5}};
    for (int i = 0; i < 17; ++i) f_(cx + hx * nodes[i][0], cy + hy * nodes[i][1], &values_[i * n_]);

    const double ratio = (l2 * l2) / (l3 * l3);
    double diff_x = 0, diff_y = 0;
    Cell cell{r, integrals.size() / n_, 0, true};
    for (std::size_t k = 0; k < n_; ++k) {
      const auto v = [&](int i) { return values_[i * n_ + k]; };
      const double s2 = v(1) + v(2) + v(3) + v(4), s3 = v(5) + v(6) + v(7) + v(8);
      const double s4 = v(9) + v(10) + v(11) + v(12), s5 = v(13) + v(14) + v(15) + v(16);
      const double seven = area * (w1 * v(0) + w2 * s2 + w3 * s3 + w4 * s4 + w5 * s5);
      const double five = area * (e1 * v(0) + e2 * s2 + e3 * s3 + e4 * s4);
      integrals.push_back(seven);
      errors.push_back(std::abs(seven - five));
      cell.worst = std::max(cell.worst, errors.back());
      diff_x += std::abs(v(1) + v(2) - 2 * v(0) - ratio * (v(5) + v(6) - 2 * v(0)));
      diff_y += std::abs(v(3) + v(4) - 2 * v(0) - ratio * (v(7) + v(8) - 2 * v(0)));
    }
    // If the differences are equal (constant functions, noise), the longer side is split.
    cell.split_x = std::abs(diff_x - diff_y) > 1e-12 * (diff_x + diff_y) ? diff_x > diff_y : hx > hy;
    return cell;
  }

 private:
  const Integrand2& f_;
  std::size_t n_;
  std::vector<double> values_;
};

// A cell this thin can't be halved in double precision.
bool splittable(const Rect& r, bool split_x) {
  const double eps = 16 * std::numeric_limits<double>::epsilon();
  return split_x ? r.x1 - r.x0 > eps * std::max(std::abs(r.x0), std::abs(r.x1))
                 : r.y1 - r.y0 > eps * std::max(std::abs(r.y0), std::abs(r.y1));
}

}  // namespace

CubatureResult integrate(const Integrand2& f, std::size_t components, const std::vector<Rect>& cells,
                         const CubatureOptions& options) {
  GenzMalik rule(f, components);
  std::vector<double> integrals, errors;
  std::priority_queue<Cell, std::vector<Cell>, Smaller> queue;
  for (const Rect& r : cells) queue.push(rule.apply(r, integrals, errors));

  CubatureResult result;
  const auto sum_up = [&] {
    result.value.assign(components, 0);
    result.error.assign(components, 0);
    for (std::size_t i = 0; i < integrals.size(); ++i) {
      result.value[i % components] += integrals[i];
      result.error[i % components] += errors[i];
    }
    result.converged = true;
    for (std::size_t k = 0; k < components; ++k)
      // "not <=", so that a NaN does not count as converged
      if (!(result.error[k] <= std::max(options.absolute, options.relative * std::abs(result.value[k]))))
        result.converged = false;
  };
  sum_up();
  std::vector<double> half_integrals, half_errors;
  for (int since = 0; !result.converged && !queue.empty() && int(integrals.size() / components) < options.max_cells;) {
    const Cell cell = queue.top();
    queue.pop();
    const Rect& r = cell.rect;
    if (!splittable(r, cell.split_x)) continue;  // the cell keeps its error
    Rect a = r, b = r;
    if (cell.split_x)
      a.x1 = b.x0 = 0.5 * (r.x0 + r.x1);
    else
      a.y1 = b.y0 = 0.5 * (r.y0 + r.y1);
    half_integrals.clear();
    half_errors.clear();
    Cell first = rule.apply(a, half_integrals, half_errors), second = rule.apply(b, half_integrals, half_errors);
    first.slot = cell.slot;
    second.slot = integrals.size() / components;
    for (std::size_t k = 0; k < components; ++k) {
      const std::size_t i = cell.slot * components + k;
      result.value[k] += half_integrals[k] + half_integrals[components + k] - integrals[i];
      result.error[k] += half_errors[k] + half_errors[components + k] - errors[i];
      integrals[i] = half_integrals[k];
      errors[i] = half_errors[k];
      integrals.push_back(half_integrals[components + k]);
      errors.push_back(half_errors[components + k]);
    }
    queue.push(first);
    queue.push(second);
    bool small = true;
    for (std::size_t k = 0; k < components; ++k)
      small = small && result.error[k] <= std::max(options.absolute, options.relative * std::abs(result.value[k]));
    // The running sums accumulate rounding errors. They are recomputed now and then, and before they decide that the
    // integral has converged.
    if (small || ++since == 1000) {
      sum_up();
      since = 0;
    }
  }
  sum_up();
  result.cells = int(integrals.size() / components);
  return result;
}

std::vector<Rect> partition(const Rect& whole, const std::vector<Point2>& points, std::size_t most) {
  struct Part {
    Rect rect;
    std::vector<Point2> points;
  };
  const auto inside = [](const Rect& r, const Point2& p) {
    return p.x >= r.x0 && p.x < r.x1 && p.y >= r.y0 && p.y < r.y1;
  };
  std::vector<Rect> out;
  std::vector<Part> stack{{whole, {}}};
  for (const Point2& p : points)
    if (inside(whole, p)) stack[0].points.push_back(p);
  while (!stack.empty()) {
    Part part = std::move(stack.back());
    stack.pop_back();
    const Rect& r = part.rect;
    double x0 = r.x1, x1 = r.x0, y0 = r.y1, y1 = r.y0;
    for (const Point2& p : part.points) {
      x0 = std::min(x0, p.x), x1 = std::max(x1, p.x);
      y0 = std::min(y0, p.y), y1 = std::max(y1, p.y);
    }
    // A cell with few points that are spread over it is done. A few points in one corner mark the flank of a peak.
    const bool filled = part.points.size() < 2 || (x1 - x0 > 0.25 * (r.x1 - r.x0) && y1 - y0 > 0.25 * (r.y1 - r.y0));
    if (part.points.size() <= most && filled) {
      out.push_back(r);
      continue;
    }
    // Splits along the axis in which the bulk of the points covers the smaller part of the cell, which closes in on a
    // peak fastest. Splitting along the other axis first would leave parts with a single point that still extend far
    // from the peak. The spread is measured between quartiles, so that outliers don't hide the bulk.
    const auto spread = [&](double Point2::*axis) {
      std::vector<double> v;
      for (const Point2& p : part.points) v.push_back(p.*axis);
      const std::size_t low = v.size() / 4, high = v.size() - 1 - low;
      std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(low), v.end());
      const double a = v[low];
      std::nth_element(v.begin(), v.begin() + std::ptrdiff_t(high), v.end());
      return v[high] - a;
    };
    const double fill_x = spread(&Point2::x) / (r.x1 - r.x0), fill_y = spread(&Point2::y) / (r.y1 - r.y0);
    bool split_x = fill_x < fill_y;
    // Points that coincide (those of a mirror, or those crowded at a border) can't be separated by halving, so halving
    // stops.
    const auto thick = [&](bool x) {
      return splittable(r, x) &&
             (x ? r.x1 - r.x0 > 1e-12 * (whole.x1 - whole.x0) : r.y1 - r.y0 > 1e-12 * (whole.y1 - whole.y0));
    };
    if (!thick(split_x)) split_x = !split_x;
    if (!thick(split_x)) {
      out.push_back(r);
      continue;
    }
    Part a{r, {}}, b{r, {}};
    if (split_x)
      a.rect.x1 = b.rect.x0 = 0.5 * (r.x0 + r.x1);
    else
      a.rect.y1 = b.rect.y0 = 0.5 * (r.y0 + r.y1);
    for (const Point2& p : part.points) (inside(a.rect, p) ? a : b).points.push_back(p);
    stack.push_back(std::move(b));
    stack.push_back(std::move(a));
  }
  return out;
}

}  // namespace brdfc::measure
