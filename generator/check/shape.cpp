// SPDX-License-Identifier: GPL-3.0-or-later
// Checks the shape of the lobe above the surface, and its limits at the ends of parameter ranges.
#include <sstream>

#include "check/claim.h"
#include "measure/bound_model.h"
#include "measure/probes.h"
#include "measure/properties.h"

namespace brdfc::check {
namespace {

/// Jumps of a derivative: below kSmooth it may be rounding or curvature; above kEdge it is a visible edge.
constexpr double kSmooth = 1e-3;
constexpr double kEdge = 1e-2;
/// If at least this share of the light is near ideal reflection, the lobe counts as a mirror.
constexpr double kMirror = 0.99;

/// Calls f(case, random numbers) for the cases whose lobe is entirely above the surface. Other lobes have no shape
/// there to check.
template <class F> void for_each_upper(const Trial& t, Purpose what, const F& f) {
  t.for_each([&](const Case& c) {
    if (c.bound.brdf->scatters_through()) return;
    measure::Random random = t.random(c, what);
    f(c, random);
  });
}

/// The case's values with colours between black and white; those extremes would hide the behaviour of f.
ParamValues with_inner_colors(const Trial& t, const Case& c) {
  ParamValues inner = c.bound.values;
  for (const ParamInfo& p : t.info().params)
    if (p.kind == ParamKind::Color)
      for (double& x : std::get<std::array<double, 3>>(inner[p.name])) x = 0.1 + 0.8 * x;
  return inner;
}

// Claims about the lobe hold within the sliders' ranges. A declared failure may also appear at the end of a parameter's
// range.

void positive(const Trial& t, Verdict& verdict) {
  for_each_upper(t, Purpose::Positive, [&](const Case& c, measure::Random& random) {
    if (!c.within && t.claims().positive) return;
    const auto place = measure::find_dark_place(t.model(), with_inner_colors(t, c), t.scaled(256), random);
    verdict.add(place ? 1 : 0, place.value_or(c.bound.label));
  });
}

void smooth(const Trial& t, Verdict& verdict) {
  // One edge is enough where one is declared. It may be rare: thin_film's, where a colour leaves the working space, is
  // on few arcs.
  const bool declared = !t.claims().smooth;
  bool found = false;
  for_each_upper(t, Purpose::Smooth, [&](const Case& c, measure::Random& random) {
    if ((!c.within && !declared) || found) return;
    const measure::Edge e = measure::sharpest_edge(measure::bind_model(t.model(), with_inner_colors(t, c)),
                                                   t.scaled(declared ? 800 : 24), random);
    found = declared && e.jump >= kEdge;
    verdict.add(e.jump, e.where);
  });
}

void not_matte(const Trial& t, Verdict& verdict) {
  for_each_upper(t, Purpose::Matte, [&](const Case& c, measure::Random& random) {
    if (const auto u = measure::unevenness(*c.bound.brdf, 128, random)) verdict.add(*u, c.bound.label);
  });
}

void not_mirror(const Trial& t, Verdict& verdict) {
  for_each_upper(t, Purpose::Mirror, [&](const Case& c, measure::Random& random) {
    if (const auto share = measure::least_mirror_share(*c.bound.brdf, t.scaled(512), random))
      verdict.add(*share, c.bound.label);
  });
}

/// The model with values from a text such as "n=0 m=1".
measure::BoundModel at_limit(const Trial& t, const std::string& limit) {
  std::vector<std::string> assignments;
  std::istringstream in(limit);
  for (std::string one; in >> one;) assignments.push_back(one);
  return measure::bind_model(t.model(), parse_values(t.info(), assignments));
}

void matte(const Trial& t, Verdict& verdict) {
  const measure::BoundModel b = at_limit(t, t.claims().diffuse_limit);
  measure::Random random = t.random();
  const auto u = measure::unevenness(*b.brdf, 1024, random);
  verdict.add(u.value_or(1), u ? b.label : b.label + ": f is 0");
}

void mirror(const Trial& t, Verdict& verdict) {
  const measure::BoundModel b = at_limit(t, t.claims().specular_limit);
  measure::Random random = t.random();
  const auto share = measure::least_mirror_share(*b.brdf, 8192, random);
  verdict.add(1 - share.value_or(0), share ? b.label : b.label + ": no light");
}

}  // namespace

std::vector<Check> shape_checks(const ModelProperties& claims) {
  return {check_of(claims.specular_limit, "specular_limit",
                   {"specular limit", "share away from ideal reflection at " + claims.specular_limit,
                    at_most(1 - kMirror), mirror},
                   {"no specular limit", "light leaves elsewhere at every end of a range", at_most(kMirror), not_mirror,
                    without_upper_lobe}),
          check_of(claims.diffuse_limit, "diffuse_limit",
                   {"diffuse limit", "f constant at " + claims.diffuse_limit, at_most(kEven), matte, without_lobe},
                   {"no diffuse limit", "f not constant at any end of a range", at_least(kVisible), not_matte,
                    without_upper_lobe}),
          // The value is 1 at a place where f is 0.
          check_of(claims.positive, "positive",
                   {"positive", "f > 0 above the surface, underflow aside", at_most(0), positive, without_upper_lobe},
                   {"not positive", "f = 0 somewhere, not by underflow", somewhere_at_least(1), positive,
                    without_upper_lobe}),
          check_of(claims.smooth, "smooth",
                   {"smooth", "no jump of a derivative of f", at_most(kSmooth), smooth, without_upper_lobe},
                   {"not smooth", "a derivative of f jumps visibly somewhere", somewhere_at_least(kEdge), smooth,
                    without_upper_lobe})};
}

}  // namespace brdfc::check
