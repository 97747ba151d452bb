// SPDX-License-Identifier: GPL-3.0-or-later
// A twin: Blender's own nodes with weights, roughness and tilt that depend on the view, whose sum comes close to a
// BRDF. For where OSL does not run: EEVEE, GPUs but NVIDIA's, render farms. For a material whose parameters are all
// known.
//
// Facet lobes whose normals lean towards or away from the viewer, a Diffuse BSDF, and for an ideal mirror one more.
// Native nodes take no negative colours, so weights are least absolute differences that are not negative, with the
// albedo kept; leaning and roughness are found by a search from one view to the next.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fit/view.h"
#include "tables/table.h"

namespace brdfc::fit {

/// Cosines of the view, evenly spaced from 0 to 1, at which a twin is given. A curve node of Blender is a table of 256
/// values, linear between: every fifth is a knot.
inline constexpr int kTwinKnots = 52;

/// Tables over the cosine of the view: of three channels, or of one that does for all.
using Channels = std::vector<std::shared_ptr<const Table>>;

/// What a node takes, over the cosine of the view.
struct TwinClosure {
  ClosureKind kind;  ///< Ggx, Beckmann, Diffuse or Reflection
  /// Facets, else null: their normal is along (1 - lean) N + lean wo; negative values lean away from the viewer.
  std::shared_ptr<const Table> lean;
  std::shared_ptr<const Table> roughness;  ///< facets: root of alpha, in [0, 1]
  /// Facets: they are a pair, of half the weight each, that also leans to both sides of the plane of incidence, by
  /// (N x wo) times this and its negative.
  std::shared_ptr<const Table> spread;
  Channels weight;  ///< not negative; without the tint
};

class Twin {
 public:
  /// Takes seconds. `values` has every parameter, and unfit() (values.h) nothing against them. Throws ValueError where
  /// the model gives a value that is NaN, infinite or negative.
  Twin(const Model&, const ParamValues& values);

  /// What the nodes are.
  const std::vector<TwinClosure>& parts() const { return parts_; }
  /// One factor of all weights and of the albedo, where that is all that tells channels apart.
  const std::optional<Rgb<double>>& tint() const { return tint_; }
  /// Directional albedo of what the model scatters, without the tint.
  const Channels& albedo() const { return albedo_; }
  /// What the nodes make of it for a view above the surface.
  ClosureSum<double> closures(const Vec3<double>& wo) const;
  /// How far they are from the model, as view_errors() measures it.
  const std::vector<ViewError>& errors() const { return errors_; }

 private:
  std::vector<TwinClosure> parts_;
  std::optional<Rgb<double>> tint_;
  Channels albedo_;
  std::vector<ViewError> errors_;
};

/// The twin for these values, made at first use and kept while the program runs. They may lack factors (roles.h), for
/// which it has 1.
const Twin& twin_of(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
