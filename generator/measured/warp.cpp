// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/warp.h"

#include <algorithm>
#include <cmath>

namespace brdfc::measured {
namespace {

struct Interval {
  std::size_t first, second;
  double weight;  // of the second
};
Interval interval(const std::vector<float>& at, double x) {
  const std::size_t last = at.size() - 1;
  if (last == 0 || x <= double(at[0])) return {0, 0, 0};
  if (x >= double(at[last])) return {last, last, 0};
  const std::size_t second = std::size_t(std::upper_bound(at.begin(), at.end(), x) - at.begin());
  const double a = at[second - 1], b = at[second];
  return {second - 1, second, (x - a) / (b - a)};
}

double mix(double a, double b, double weight) { return a * (1 - weight) + b * weight; }

/// Where, from 0 to 1, the integral of a function that is linear from a to b over an interval of length `width` is
/// `sum`.
double inverse_integral(double a, double b, double sum, double width) {
  const double target = 2 * std::max(sum, 0.) / width, root = a + std::sqrt(std::max(a * a + (b - a) * target, 0.));
  return root > 0 ? std::min(target / root, 1.) : 0.5;
}

/// The integral from 0 to u of a function that is linear from a to b, over an interval of length `width`.
double integral(double a, double b, double u, double width) { return u * mix(a, b, 0.5 * u) * width; }

}  // namespace

Blend blend(const std::vector<float>& phis, const std::vector<float>& thetas, double phi, double theta) {
  const Interval p = interval(phis, phi), t = interval(thetas, theta);
  Blend out{};
  for (int i = 0; i < 4; ++i) {
    const double weight = (i & 2 ? p.weight : 1 - p.weight) * (i & 1 ? t.weight : 1 - t.weight);
    if (!(weight > 0)) continue;
    out.slice[out.count] = (i & 2 ? p.second : p.first) * thetas.size() + (i & 1 ? t.second : t.first);
    out.weight[out.count++] = weight;
  }
  return out;
}

std::size_t Warp::empty_slice(const std::vector<float>& data, std::size_t width, std::size_t height) {
  const std::size_t size = width * height, slices = data.size() / size;
  for (std::size_t s = 0; s < slices; ++s)
    if (std::none_of(data.begin() + long(s * size), data.begin() + long((s + 1) * size), [](float v) { return v > 0; }))
      return s;
  return slices;
}

Warp::Warp(std::vector<float> data, std::size_t width, std::size_t height, bool cumulative)
    : data_(std::move(data)), width_(width), height_(height) {
  if (!cumulative) return;
  const std::size_t size = width * height, slices = data_.size() / size;
  rows_.resize(slices * height * (width - 1));
  columns_.resize(slices * (height - 1));
  const double step_x = 0.5 / double(width - 1), step_y = 0.5 / double(height - 1);
  for (std::size_t s = 0; s < slices; ++s) {
    float* const values = &data_[s * size];
    float* const rows = &rows_[s * height * (width - 1)];
    float* const columns = &columns_[s * (height - 1)];
    std::vector<double> sums(height), totals(height - 1);
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x + 1 < width; ++x)
        sums[y] += step_x * (double(values[y * width + x]) + double(values[y * width + x + 1]));
    double total = 0;
    for (std::size_t y = 0; y + 1 < height; ++y) totals[y] = total += step_y * (sums[y] + sums[y + 1]);
    // In double precision, where no quotient of two floats overflows.
    for (std::size_t y = 0; y + 1 < height; ++y) columns[y] = float(totals[y] / total);
    for (std::size_t y = 0; y < height; ++y) {
      double sum = 0;
      for (std::size_t x = 0; x + 1 < width; ++x) {
        sum += step_x * (double(values[y * width + x]) + double(values[y * width + x + 1]));
        rows[y * (width - 1) + x] = float(sum / total);
      }
    }
    for (std::size_t i = 0; i < size; ++i) values[i] = float(double(values[i]) / total);
  }
}

Warp::Cell Warp::cell(const Point2& at) const {
  const double x = std::clamp(at.x, 0., 1.) * double(width_ - 1), y = std::clamp(at.y, 0., 1.) * double(height_ - 1);
  const std::size_t ix = std::min(std::size_t(x), width_ - 2), iy = std::min(std::size_t(y), height_ - 2);
  return {ix, iy, x - double(ix), y - double(iy)};
}

double Warp::value(std::size_t x, std::size_t y, const Blend& b) const {
  double sum = 0;
  for (std::size_t i = 0; i < b.count; ++i) sum += b.weight[i] * double(data_[(b.slice[i] * height_ + y) * width_ + x]);
  return sum;
}

double Warp::row_sum(std::size_t x, std::size_t y, const Blend& b) const {
  double sum = 0;
  for (std::size_t i = 0; i < b.count; ++i)
    sum += b.weight[i] * double(rows_[(b.slice[i] * height_ + y) * (width_ - 1) + x]);
  return sum;
}

double Warp::column_sum(std::size_t y, const Blend& b) const {
  double sum = 0;
  for (std::size_t i = 0; i < b.count; ++i) sum += b.weight[i] * double(columns_[b.slice[i] * (height_ - 1) + y]);
  return sum;
}

double Warp::eval(const Point2& at, const Blend& b) const {
  const Cell c = cell(at);
  return mix(mix(value(c.x, c.y, b), value(c.x + 1, c.y, b), c.u),
             mix(value(c.x, c.y + 1, b), value(c.x + 1, c.y + 1, b), c.u), c.v);
}

Point2 Warp::invert(const Point2& at, const Blend& b) const {
  const Cell c = cell(at);
  const double left = mix(value(c.x, c.y, b), value(c.x, c.y + 1, b), c.v),
               right = mix(value(c.x + 1, c.y, b), value(c.x + 1, c.y + 1, b), c.v);
  double x = integral(left, right, c.u, 1 / double(width_ - 1));
  if (c.x > 0) x += mix(row_sum(c.x - 1, c.y, b), row_sum(c.x - 1, c.y + 1, b), c.v);
  const double low = row_sum(width_ - 2, c.y, b), high = row_sum(width_ - 2, c.y + 1, b), whole = mix(low, high, c.v);
  double y = integral(low, high, c.v, 1 / double(height_ - 1));
  if (c.y > 0) y += column_sum(c.y - 1, b);
  // A row without any value is mapped to nothing; the middle is as good as any place in it.
  return {whole > 0 ? x / whole : 0.5, y};
}

Point2 Warp::sample(const Point2& u, const Blend& b) const {
  // The first of `count` sums that is larger than a number; the last one if none is.
  const auto find = [](std::size_t count, double number, const auto& sum) {
    std::size_t first = 0;
    while (count > 1) {
      const std::size_t half = count / 2;
      if (sum(first + half - 1) > number)
        count = half;
      else
        first += half, count -= half;
    }
    return first;
  };
  const std::size_t y = find(height_ - 1, u.y, [&](std::size_t k) { return column_sum(k, b); });
  const double low = row_sum(width_ - 2, y, b), high = row_sum(width_ - 2, y + 1, b);
  const double v = inverse_integral(low, high, u.y - (y > 0 ? column_sum(y - 1, b) : 0), 1 / double(height_ - 1));
  const auto in_row = [&](std::size_t k) { return mix(row_sum(k, y, b), row_sum(k, y + 1, b), v); };
  const double target = u.x * in_row(width_ - 2);
  const std::size_t x = find(width_ - 1, target, in_row);
  const double left = mix(value(x, y, b), value(x, y + 1, b), v),
               right = mix(value(x + 1, y, b), value(x + 1, y + 1, b), v);
  const double along = inverse_integral(left, right, target - (x > 0 ? in_row(x - 1) : 0), 1 / double(width_ - 1));
  return {(double(x) + along) / double(width_ - 1), (double(y) + v) / double(height_ - 1)};
}

}  // namespace brdfc::measured
