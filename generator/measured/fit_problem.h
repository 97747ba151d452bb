// SPDX-License-Identifier: GPL-3.0-or-later
// A model that is fitted to pairs of directions of measured data: which of its numbers are searched for, and its
// colours, which follow from these.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "measured/pairs.h"
#include "measured/search_range.h"
#include "model/registry.h"

namespace brdfc::measured {

/// Of the data: none if they are isotropic.
enum class Axes { None, Aligned, Turned };

/// Whether a number is an angle without ends.
bool is_circle(const ParamInfo&);

/// A number that is searched for, on its slider and beyond.
struct Searched {
  explicit Searched(const ParamInfo& p) : info(&p), scale(p.slider().scale), range(range_of(p)) {}

  /// The place on the slider of the default.
  double default_place() const { return std::clamp(range.place(info->value[0]), 0., 1.); }
  /// Whether a search ended where more might be better. The ends of shares and angles, and exponents of 0, are no such
  /// places, unless the model accepts more.
  bool stopped(double t) const;

  const ParamInfo* info;
  AxisScale scale;
  SearchRange range;

 private:
  static SearchRange range_of(const ParamInfo&);
};

/// A model with its choices made, and what is searched for: the numbers that f depends on.
class Problem {
 public:
  /// `axes`: of the data, of which `pairs` are a few.
  Problem(const Model&, const ParamValues& choices, Axes axes, const Pairs& pairs);

  /// Whether the model lets light through, so that nothing is searched for.
  bool through() const { return brdf_->scatters_through(); }
  const std::vector<Searched>& searched() const { return searched_; }
  const ParamValues& values() const { return values_; }
  /// Number of parameters that are found.
  int free() const { return int(searched_.size() + colors_.size()); }

  /// Sets the searched numbers to places on their sliders.
  void set_numbers(const std::vector<double>& t);

  /// Finds the colours, and the matte light if it is asked for, with the numbers as they are; returns the error.
  double solve(const Pairs&, std::optional<Rgb<double>>& matte);

  /// The share of a white world's light that goes by an ideal mirror, which a table of values does not hold.
  double mirror() const;

 private:
  /// Of each colour and, last, the matte light.
  using Found = std::vector<Rgb<double>>;

  Colors eval(const Pairs&) const;
  void set(const ParamInfo&, double);
  void set(const ParamInfo&, const Rgb<double>&);
  void set_colors(const Found&);
  void without_mirror(const ParamInfo&);
  bool matters(const ParamInfo&, const std::vector<const ParamInfo*>& numbers, const Pairs&);
  bool same_at_zero(const ParamInfo& number, const ParamInfo& color, const Pairs&);
  std::vector<Colors> slopes(const Pairs&, const Found& base, const Colors& at_base, bool near);
  Colors solve_linear(const Pairs&, const Found& base, bool near, Found& found);

  const ModelInfo& info_;
  ParamValues values_;
  std::unique_ptr<Brdf<double>> brdf_;
  std::vector<const ParamInfo*> colors_;
  std::vector<Searched> searched_;
};

}  // namespace brdfc::measured
