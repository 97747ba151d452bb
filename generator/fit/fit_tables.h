// SPDX-License-Identifier: GPL-3.0-or-later
// What a fit consists of: tables of its closures over the axis, if it has one, and the view.
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

/// All tables but `position` run over the place of the axis' knots, if there is an axis, and view_place(); those of
/// ramps then over the position in the ramp. Rows of knots are even: `position` leads from a place on the axis to
/// theirs.
struct FitTables {
  /// A phong_ramp. Along an axis lobes change by factors: then the offset is in units of 1 / sqrt(exponent), so that
  /// lobes keep their places beside each other, and the exponent is its logarithm.
  struct LobeTables {
    TablePtr offset, exponent;
  };
  struct FacetTables {
    ClosureKind kind;
    TablePtr offset;                  ///< radians, as of Facet
    TablePtr log_alpha, log_stretch;  ///< natural logarithms
  };
  /// A ramp's weight by term, and its colours times that weight by term and channel; without a ramp no weight, and the
  /// weight's colour for `colour`. Along an axis in units of the term's amplitude. One channel where `grey`, else
  /// three.
  struct LinearTables {
    std::vector<TablePtr> weight;
    std::vector<std::vector<TablePtr>> colour;
  };

  std::optional<FitAxis> axis;
  Terms terms;
  std::vector<double> knots;  ///< places on the axis, in [0, 1]; 0 without one
  /// Where tables over the view begin, as view_place(), and how much of it they have.
  double first_view = 0, view_length = 1;
  int family = 0;                   ///< the Family that closures are of
  bool grey = false;                ///< whether one channel serves all, with a tint
  double scale = 1;                 ///< of all closures along an axis, whose fit is made with factors of 1
  Rgb<double> tint{};               ///< of all closures, in their weights; its largest channel is 1
  TablePtr position;                ///< null without an axis
  std::vector<TablePtr> amplitude;  ///< along an axis, by term: logarithm of what the term reflects, mean of channels
  std::vector<LobeTables> lobes;
  std::vector<LinearTables> linear;  ///< of the lobes, of the diffuse_ramp, of the facets
  std::vector<FacetTables> facets;
  std::vector<ViewError> errors;

  /// Makes the tables of what was fitted at these places of the axis, in place of those that there are; without an axis
  /// of the only solution. `axis` and `terms` must be set; `knots` and `errors` stay.
  void tabulate(const std::vector<double>& places, const std::vector<Solution>&);
  /// All tables, in the order in which files have them.
  std::vector<TablePtr> all() const;
  /// The same for these views alone, of those views its errors; what lies beyond them is shown as the nearest knot.
  FitTables cut_to(const Cosines& views) const;
  /// Multiplies the closures of a fit along an axis.
  void multiply(const Rgb<double>& factor);
};

/// A number as a table keeps it: to six digits and single precision. More the shader does not keep, and shorter texts
/// have no more digits.
double rounded(double);

/// The numbers of an error in the order in which files have them.
std::array<double*, 6> numbers_of(ViewError&);

}  // namespace brdfc::fit
