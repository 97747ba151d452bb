// SPDX-License-Identifier: GPL-3.0-or-later
// The contents of a fit: tables of its closures over the axis, if it has one, and the view.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "core/cosines.h"
#include "fit/axis.h"
#include "fit/solution.h"
#include "fit/terms.h"
#include "fit/view.h"
#include "tables/table.h"

namespace brdfc::fit {

using TablePtr = std::shared_ptr<const Table>;

/// All tables except `position` run over the place among the axis' knots, if there is an axis, and over view_place().
/// Tables of ramps also run over the position in the ramp. Their rows for knots are evenly spaced: `position` maps a
/// place on the axis to a place among the knots.
struct FitTables {
  /// Tables of a phong_ramp. Along an axis the width of a lobe may vary by orders of magnitude. So the offset is in
  /// units of 1 / sqrt(exponent), which keeps the lobes' relative positions, and the exponent is stored as its
  /// logarithm.
  struct LobeTables {
    TablePtr offset, exponent;
  };
  struct FacetTables {
    ClosureKind kind;
    TablePtr offset;                  ///< radians, as in Facet
    TablePtr log_alpha, log_stretch;  ///< natural logarithms
  };
  /// The weight of a ramp by term, and its colours times that weight by term and channel. A closure without a ramp has
  /// no `weight`; `colour` has the colour of its weight. Along an axis the values are relative to the term's amplitude.
  /// There is one channel if `grey`, otherwise three.
  struct LinearTables {
    std::vector<TablePtr> weight;
    std::vector<std::vector<TablePtr>> colour;
  };

  std::optional<FitAxis> axis;
  Terms terms;
  std::vector<double> knots;  ///< places on the axis, in [0, 1]; {0} without an axis
  /// The range of views that the tables cover: its start, as view_place(), and its length.
  double first_view = 0, view_length = 1;
  int family = 0;                   ///< the Family of the closures
  bool grey = false;                ///< whether one channel serves all three, with a tint
  double scale = 1;                 ///< factor of all closures along an axis, for which a fit is made with factors of 1
  Rgb<double> tint{};               ///< factor of all closures' weights; its largest channel is 1
  TablePtr position;                ///< null without an axis
  std::vector<TablePtr> amplitude;  ///< along an axis, by term: logarithm of the term's albedo, mean of channels
  std::vector<LobeTables> lobes;
  std::vector<LinearTables> linear;  ///< for the lobes, then the diffuse_ramp, then the facets
  std::vector<FacetTables> facets;
  std::vector<ViewError> errors;

  /// Replaces the tables by those of the solutions at these places on the axis; without an axis there is one solution.
  /// `axis` and `terms` must be set; `knots` and `errors` do not change.
  void tabulate(const std::vector<double>& places, const std::vector<Solution>&);
  /// All tables, in the order of files.
  std::vector<TablePtr> all() const;
  /// The tables restricted to these views, with the errors of these views. Views outside the range look like the
  /// nearest knot.
  FitTables cut_to(const Cosines& views) const;
  /// Multiplies the closures of a fit along an axis.
  void multiply(const Rgb<double>& factor);
};

/// A number as tables store it: rounded to six digits and single precision. Shaders have no more precision, and with
/// fewer digits their source is shorter.
double rounded(double);

/// The members of an error, in the order of files.
std::array<double*, 6> numbers_of(ViewError&);

}  // namespace brdfc::fit
