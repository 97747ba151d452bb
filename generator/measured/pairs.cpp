// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/pairs.h"

#include "core/sequence.h"
#include "model/sampling.h"

namespace brdfc::measured {

Pairs make_pairs(const MeasuredModel& data, std::size_t count, std::uint64_t seed) {
  const auto brdf = data.make_double({});
  Sequence3 lights(seed);
  Sequence2 views(seed + 1);
  Pairs out;
  std::vector<double> weight;
  for (std::size_t i = 0; i < count; ++i) {
    const Point2 v = views.next();
    const Vec3<double> wo = sample_cosine(v.x, v.y);
    const Sample<double> s = brdf->sample(wo, lights.next());
    if (!(s.pdf > 0) || !(wo.z > 1e-3)) continue;
    out.wi.push_back(s.wi);
    out.wo.push_back(wo);
    weight.push_back(s.wi.z / s.pdf / double(count));
    out.data.push_back(brdf->eval(s.wi, wo));
    const Rgb<double>& d = out.data.back();
    out.light += weight.back() * (d.r + d.g + d.b);
  }
  out.weight = Eigen::Map<const Eigen::VectorXd>(weight.data(), Eigen::Index(weight.size()));
  return out;
}

double error_of(const Pairs& p, const Colors& f) {
  double off = 0;
  for (std::size_t k = 0; k < f.size(); ++k) {
    const Rgb<double> d = magnitude(f[k] - p.data[k]);
    off += p.weight[Eigen::Index(k)] * (d.r + d.g + d.b);
  }
  return p.light > 0 ? off / p.light : 0;
}

}  // namespace brdfc::measured
