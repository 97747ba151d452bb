// SPDX-License-Identifier: GPL-3.0-or-later
// A twin: Blender's own nodes with weights, roughness and tilt that depend on the view, whose sum comes close to a
// BRDF. For where OSL does not run: EEVEE, GPUs but NVIDIA's, render farms. Its tables may run over one number besides,
// and weights over the terms of mixed parameters (terms.h), so that sliders move it.
//
// Facet lobes whose normals lean towards or away from the viewer, a Diffuse BSDF, and for an ideal mirror one more.
// Native nodes take no negative colours, so weights are least absolute differences that are not negative, with the
// albedo kept; leaning and roughness are found by a search from one view to the next (twin_search.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/along.h"
#include "fit/evaluate.h"
#include "fit/fit_tables.h"
#include "fit/view.h"
#include "tables/store.h"
#include "tables/table.h"

namespace brdfc::fit {

/// Cosines of the view, evenly spaced from 0 to 1, at which a twin is given. A curve node of Blender is a table of 256
/// values, linear between: every fifth is a knot.
inline constexpr int kTwinKnots = 52;

/// Tables of three channels, or of one that does for all.
using Channels = std::vector<TablePtr>;

/// What a node takes: tables over the place on the axis, if there is one, then over the cosine of the view.
struct TwinClosure {
  ClosureKind kind;  ///< Ggx, Beckmann, Diffuse or Reflection
  /// Facets, else null: their normal is along (1 - lean) N + lean wo; negative values lean away from the viewer.
  TablePtr lean;
  TablePtr roughness;  ///< facets: root of alpha, in [0, 1]
  /// Facets: they are a pair, of half the weight each, that also leans to both sides of the plane of incidence, by
  /// (N x wo) times this and its negative.
  TablePtr spread;
  /// By term of terms(), a Reflection's of mirror_terms(); not negative; without the tint, which a Reflection lacks.
  std::vector<Channels> weight;
};

class Twin {
 public:
  /// `values` may lack mixed parameters, and one number, which becomes the axis: then it takes a minute, else seconds,
  /// unless it is kept (stored_twin()). Throws ValueError where the model gives a value that is NaN, infinite or
  /// negative; std::logic_error where its mirror is no polynomial of the mixed parameters; InputError naming the file
  /// that is kept if it is damaged.
  enum class From { Store, Scratch };
  Twin(const Model&, const ParamValues& values, From from = From::Store);

  /// Keeps it (store.h) in place of what is kept of the model. `values` are those of the constructor.
  void store(const Model&, const ParamValues& values) const;

  /// The number that tables run over, at even places of its slider.
  const std::optional<FitAxis>& axis() const { return axis_; }
  const Terms& terms() const { return terms_; }
  /// Of the mirror: as terms(), of the same parameters.
  const Terms& mirror_terms() const { return mirror_terms_; }
  /// What the nodes are.
  const std::vector<TwinClosure>& parts() const { return parts_; }
  /// One factor of all weights but a mirror's and of the albedo, where that is all that tells channels apart.
  const std::optional<Rgb<double>>& tint() const { return tint_; }
  /// Directional albedo by term of what the model scatters, without the tint.
  const std::vector<Channels>& albedo() const { return albedo_; }
  /// What the nodes make of it for a view above the surface.
  ClosureSum<double> closures(const Vec3<double>& wo, const Varied<double>& = {}) const;
  /// How far they are from the model, as view_errors() measures it: with an axis at both its ends and in the middle
  /// between any two places, with mixed parameters of the worst term.
  const std::vector<ViewError>& errors() const { return errors_; }

 private:
  void make(const Model&, const Along&);
  void make_mirror(const Model&, const Along&);
  void read(const std::string& hash, const std::filesystem::path&);
  /// What read() takes.
  void write(const Model&, const ParamValues& values, const std::filesystem::path&) const;
  /// All tables, in the order in which files have them.
  std::vector<TablePtr*> all();
  std::vector<TableAxis> axes() const;
  void multiply(const Rgb<double>& factor);
  /// Places of the tables, or none without an axis.
  int places() const;

  std::optional<FitAxis> axis_;
  Terms terms_, mirror_terms_;
  std::vector<TwinClosure> parts_;
  std::optional<Rgb<double>> tint_;
  std::vector<Channels> albedo_;
  std::vector<ViewError> errors_;
};

/// What the twin for these values is kept by.
StoreKey stored_twin(const Model&, const ParamValues& values);

/// The twin for these values, made or read at first use and kept while the program runs. They may lack factors
/// (roles.h), for which it has 1.
const Twin& twin_of(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
