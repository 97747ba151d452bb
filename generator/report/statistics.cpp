// SPDX-License-Identifier: GPL-3.0-or-later
#include "report/statistics.h"

#include <cmath>
#include <stdexcept>

#include "core/error.h"

namespace brdfc {

Rendering mean_of(std::span<const Rendering> renderings) {
  if (renderings.empty()) throw std::invalid_argument("no rendering");
  if (renderings.size() == 1) return renderings.front();
  const Image& first = renderings.front().mean;
  for (const Rendering& r : renderings)
    if (r.mean.width != first.width || r.mean.height != first.height)
      throw std::invalid_argument("renderings differ in size");
  const double n = double(renderings.size());
  Rendering out;
  out.mean = Image(first.width, first.height);
  out.variance = Image(first.width, first.height);
  for (std::size_t i = 0; i < first.rgb.size(); ++i) {
    double sum = 0;
    for (const Rendering& r : renderings) sum += r.mean.rgb[i];
    double squares = 0;
    for (const Rendering& r : renderings) squares += sqr(r.mean.rgb[i] - sum / n);
    out.mean.rgb[i] = float(sum / n);
    out.variance->rgb[i] = float(squares / (n - 1) / n);
  }
  return out;
}

Difference measure_difference(const Rendering& picture, const Rendering& reference, const std::string& picture_name,
                              const std::string& reference_name) {
  const Comparison comparison = compare(picture, reference, picture_name, reference_name);
  if (!(comparison.mean_b > 0)) input_error("{}: the picture is black", reference_name);
  const std::size_t count = reference.mean.rgb.size();
  double noise = 0, variance_a = 0, variance_b = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double va = picture.variance ? picture.variance->rgb[i] : 0;
    const double vb = reference.variance ? reference.variance->rgb[i] : 0;
    noise += (va + vb) / (sqr(double(reference.mean.rgb[i])) + kRelMseEpsilon);
    variance_a += va;
    variance_b += vb;
  }
  const double ratio = comparison.mean_a / comparison.mean_b;
  Difference d;
  d.rel_mse = comparison.rel_mse;
  d.noise = noise / double(count);
  d.bias = ratio - 1;
  // First order in both means, which are independent of each other.
  d.bias_error = std::sqrt(variance_a + sqr(ratio) * variance_b) / double(count) / comparison.mean_b;
  return d;
}

}  // namespace brdfc
