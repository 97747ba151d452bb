// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/parts.h"

#include <algorithm>

#include "fit/settings.h"

namespace brdfc::fit {

using Eigen::MatrixXd;

std::vector<RampLobe> place_lobes(Family family, const Moments& here, const Moments& at_normal, double height) {
  const Moments& m = family == Family::Fixed ? at_normal : here;
  const double offset = family == Family::Fixed ? 0 : m.offset;
  const double e = std::max(m.narrow, 0.5), s = 1 / std::sqrt(std::max(m.wide, 0.5));
  // Three widths on the axis and two pairs beside it. In the family with facets, what these leave at grazing views lies
  // on one side of the axis, so wider lobes are placed there instead.
  std::vector<RampLobe> lobes = {{offset, e}, {offset + 0.7 * s, e}, {offset - 0.7 * s, e}};
  if (family == Family::Microfacet)
    lobes.insert(lobes.end(), {{offset + 1.4 * s, e / 4}, {offset + 2.8 * s, e / 16}});
  else
    lobes.insert(lobes.end(), {{offset, e / 4}, {offset, 2 * e}, {offset + 1.5 * s, e / 2}, {offset - 1.5 * s, e / 2}});
  // With an offset of -2 times the height, opposite the viewer, a closure's normal would turn over. Lobes that would be
  // below the surface at low views are moved to one of two positions, so that no two closures become equal.
  for (RampLobe& l : lobes)
    l.offset = std::clamp(l.offset, (l.offset < offset - s ? -kSettings.far_below : -kSettings.below) * height,
                          kSettings.most_back);
  return lobes;
}

MatrixXd dictionary(const std::vector<RampLobe>& lobes, const std::vector<Facet>& facets, const Points& points,
                    const Vec3<double>& wo) {
  const Vec3<double> side = mirror_side(wo);
  std::vector<Closure<double>> ramps;
  for (const RampLobe& l : lobes) ramps.push_back(lobe_closure(side, l.offset, l.exponent));
  ramps.emplace_back(ClosureKind::DiffuseRamp, Rgb<double>(1.0));
  MatrixXd a(Eigen::Index(points.wi.size()), Eigen::Index(ramps.size() * kRampSize + facets.size()));
  Eigen::Index column = 0;
  for (Closure<double>& c : ramps) {
    // Three entries of the ramp at once, one in each channel.
    for (int k = 0; k < kRampSize; k += 3) {
      for (int i = 0; i < kRampSize; ++i)
        c.ramp[std::size_t(i)] = {double(i == k), double(i == k + 1), double(i == k + 2)};
      for (std::size_t p = 0; p < points.wi.size(); ++p) {
        const Rgb<double> v = evaluate(c, points.wi[p], wo);
        const double channels[] = {v.r, v.g, v.b};
        for (int i = 0; i < 3 && k + i < kRampSize; ++i) a(Eigen::Index(p), column + k + i) = channels[i];
      }
    }
    column += kRampSize;
  }
  for (const Facet& f : facets) {
    const Closure<double> c = facet_closure(f.kind, side, f.offset, f.alpha, f.stretch);
    for (std::size_t p = 0; p < points.wi.size(); ++p) a(Eigen::Index(p), column) = evaluate(c, points.wi[p], wo).r;
    ++column;
  }
  return a;
}

}  // namespace brdfc::fit
