// SPDX-License-Identifier: GPL-3.0-or-later
// A twin: a group of Blender's own nodes with weights, roughness and tilt that depend on the view, whose sum
// approximates a BRDF. It is for renderers without OSL: EEVEE, GPUs other than NVIDIA's, render farms. Its tables may
// also run over one number, and its weights may depend on mixed parameters (terms.h), so that sliders work.
//
// It consists of facet lobes whose normals lean towards or away from the viewer, a Diffuse BSDF, and for an ideal
// mirror one more node. Blender's nodes take no negative colours, so the weights minimise the absolute differences
// among weights that are not negative, with the albedo as a constraint. Lean and roughness are found by a search from
// one view to the next (twin_search.h).
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

/// Number of view cosines, evenly spaced from 0 to 1, at which a twin is tabulated. A curve node in Blender is a table
/// of 256 values with linear interpolation; every fifth is a knot.
inline constexpr int kTwinKnots = 52;

/// Tables of three channels, or of one channel for all three.
using Channels = std::vector<TablePtr>;

/// The inputs of a node: tables over the place on the axis, if there is one, and then over the cosine of the view.
struct TwinClosure {
  ClosureKind kind;  ///< Ggx, Beckmann, Diffuse or Reflection
  /// For facets, otherwise null. Their normal is along (1 - lean) N + lean wo; negative values lean away from the
  /// viewer.
  TablePtr lean;
  TablePtr roughness;  ///< for facets: square root of alpha, in [0, 1]
  /// For facets. Each is a pair with half the weight each, whose normals also lean to both sides of the plane of
  /// incidence: by (N x wo) times this value and times its negative.
  TablePtr spread;
  /// Weights by term of terms(), or for a Reflection of mirror_terms(). They are not negative and do not include the
  /// tint, which does not apply to a Reflection.
  std::vector<Channels> weight;
};

class Twin {
 public:
  /// `values` may lack mixed parameters, and one number, which becomes the axis. Making a twin takes seconds, or a
  /// minute with an axis, unless it is stored (stored_twin()). Throws ValueError if the model returns a value that is
  /// NaN, infinite or negative; std::logic_error if its mirror is not a polynomial in the mixed parameters; InputError
  /// naming the file if a stored twin is damaged.
  enum class From { Store, Scratch };
  Twin(const Model&, const ParamValues& values, From from = From::Store);

  /// Stores the twin (store.h); it replaces the stored twin of the model. `values` are those of the constructor.
  void store(const Model&, const ParamValues& values) const;

  /// The number that tables run over; places are evenly spaced on its slider.
  const std::optional<FitAxis>& axis() const { return axis_; }
  const Terms& terms() const { return terms_; }
  /// The same for the mirror, with the same parameters.
  const Terms& mirror_terms() const { return mirror_terms_; }
  /// The nodes.
  const std::vector<TwinClosure>& parts() const { return parts_; }
  /// A common factor of the albedo and of all weights except a mirror's, if the channels differ only by that factor.
  const std::optional<Rgb<double>>& tint() const { return tint_; }
  /// Directional albedo of the scattered light (without the mirror) by term, without the tint.
  const std::vector<Channels>& albedo() const { return albedo_; }
  /// The closures of the nodes for a view above the surface.
  ClosureSum<double> closures(const Vec3<double>& wo, const Varied<double>& = {}) const;
  /// Errors relative to the model, as view_errors() measures them. With an axis: at both its ends and in the middle
  /// between any two places. With mixed parameters: for the worst of Terms::judged().
  const std::vector<ViewError>& errors() const { return errors_; }

 private:
  void make(const Model&, const Along&);
  void make_mirror(const Model&, const Along&);
  void read(const std::string& hash, const std::filesystem::path&);
  /// Writes the file that read() reads.
  void write(const Model&, const ParamValues& values, const std::filesystem::path&) const;
  /// All tables, in the order of files.
  std::vector<TablePtr*> all();
  std::vector<TableAxis> axes() const;
  void multiply(const Rgb<double>& factor);
  /// Number of places on the axis; 1 without one.
  int places() const;

  std::optional<FitAxis> axis_;
  Terms terms_, mirror_terms_;
  std::vector<TwinClosure> parts_;
  std::optional<Rgb<double>> tint_;
  std::vector<Channels> albedo_;
  std::vector<ViewError> errors_;
};

/// The key under which the twin for these values is stored.
StoreKey stored_twin(const Model&, const ParamValues& values);

/// The twin for these values, made or read at first use and cached while the program runs. `values` may lack factors
/// (roles.h), which are then 1.
const Twin& twin_of(const Model&, const ParamValues& values);

}  // namespace brdfc::fit
