// SPDX-License-Identifier: GPL-3.0-or-later
// What a model says of itself: its name and paper, what is claimed of it, and its parameters, which it declares by
// specifications (NumberSpec and the like) to a visitor; and values of parameters as text.
#pragma once

#include <array>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "core/axis_scale.h"
#include "core/vec.h"

namespace brdfc::inline model {

enum class ParamKind { Number, Color, Choice };

/// What a parameter says of the substance a surface is made of (model/optical.h).
enum class Optical {
  None,
  Index,       ///< n at the line d, of what lets light through
  Dispersion,  ///< 20 over Abbe's number, likewise
  IndexRed,
  IndexGreen,
  IndexBlue,
  ExtinctionRed,
  ExtinctionGreen,
  ExtinctionBlue,
  Reflectance,  ///< at normal incidence: a colour, or a number for what is no metal
  Tint,         ///< the same where only a metal has one: glass is told by its index
  Attenuation,  ///< share of the light that is left after a stated thickness, of what absorbs inside
  PerLength,    ///< one over that thickness
};
/// "index_r"; "" for None.
const char* name_of(Optical);

/// One parameter: the single source for the command line, manifest, sockets, tests and documentation.
struct ParamInfo {
  std::string name;                      ///< identifier, as in `name=value`
  std::string label;                     ///< for people
  std::string unit;                      ///< "" for a pure number, "rad", ...
  std::string doc;                       ///< tooltip: one sentence
  double min = 0, max = 1;               ///< accepted range, inclusive
  double soft_min = 0, soft_max = 1;     ///< the range of a slider; must lie inside [min, max]
  std::array<double, 3> value{0, 0, 0};  ///< default; a Number uses element 0, a Choice its index
  std::vector<std::string> choices;      ///< identifiers, for a Choice
  ParamKind kind = ParamKind::Number;
  /// Its effect changes by factors of the number rather than by differences.
  bool by_factors = false;
  Optical optical = Optical::None;

  /// What it is stepped through by, from one end to the other: of the slider, and of all that is accepted.
  ScaledRange slider() const;
  ScaledRange accepted() const;
};

/// A choice under which f holds tables of an integral instead of a formula for it.
struct TabulatedChoice {
  std::string parameter, choice;
  double error = 0;  ///< how far interpolation takes the albedo from what is claimed of it, at most; 0: no such choice
};

/// What the paper or this project claims of a model; tests try to prove each claim, also the negative ones.
struct ModelProperties {
  bool reciprocal = true;      ///< f(wi, wo) = f(wo, wi)
  bool conserving = true;      ///< albedo <= 1 for every view direction and admissible parameter
  bool lossless = false;       ///< albedo = 1 (colours at 1, no other loss) for every view direction
  bool isotropic = true;       ///< unchanged when both directions turn about the normal
  bool positive = true;        ///< f > 0 for all directions above the surface, colours > 0, inside the sliders' ranges
  bool smooth = true;          ///< first derivatives of f are continuous above the surface: no visible edges
  bool exact_sampling = true;  ///< sample()'s density is proportional to f cos: its weight does not depend on wi
  /// Assignments ("n=0") that make f constant, in the form parse_values reads, separated by spaces; "" if none do.
  std::string diffuse_limit = "";
  /// Assignments ("n=1e8") at which nearly all of the light leaves in the direction of ideal reflection; "" if none do.
  std::string specular_limit = "";
  TabulatedChoice tabulated = {};
  /// The number over which the repository keeps a fit (fit/fit.h), what multiplies or mixes open and the others
  /// at their defaults; "" if none.
  std::string fit_axis = "";
};

/// What a surface of a model looks like first of all: menus group models by it.
enum class Look { Undeclared, Matte, Glossy, Metal, Glass, Special };
/// "matte", "glossy", ...
std::string name_of(Look);

/// Initialisers for all, so that info() may leave out what it has nothing to say of.
struct ModelInfo {
  std::string name = {};   ///< identifier
  std::string label = {};  ///< for people
  Look look = Look::Undeclared;
  std::string paper = {};      ///< citation, "I. Name, J. Name: Title, Journal, year"
  std::string equations = {};  ///< "eqs. 10, 14, 16, 19, 20"
  std::string doc = {};        ///< one or two sentences
  ModelProperties properties = {};
  std::vector<ParamInfo> params = {};

  /// nullptr if there is none of that name.
  const ParamInfo* param(const std::string& name) const;
};

using ParamValue = std::variant<double, std::array<double, 3>, std::string>;
/// Values by name; what is missing takes its default.
using ParamValues = std::map<std::string, ParamValue>;

/// Checks names, kinds and ranges; returns every parameter with its value. Throws InputError.
ParamValues complete(const ModelInfo&, const ParamValues&);
/// Reads "name=value" (colours as r,g,b or one grey number). Throws InputError.
ParamValues parse_values(const ModelInfo&, const std::vector<std::string>& assignments);
/// The error that the model declares for a tabulated choice, 0 unless these values make it.
double table_error(const ModelInfo&, const ParamValues&);
/// Text in the form parse_values reads, parameters in schema order.
std::string format_values(const ModelInfo&, const ParamValues&);

/// A parameter's index among its choices, fixed while a formula is recorded.
struct Choice {
  int index = 0;
  operator int() const { return index; }
};

struct NumberSpec {
  const char* name;
  const char* label;
  double value;
  double min, max;
  double soft_min, soft_max;
  const char* doc;
  const char* unit = "";
  bool factors = false;
  Optical optical = Optical::None;

  /// The same, declared as ParamInfo::by_factors.
  NumberSpec by_factors() const {
    NumberSpec out = *this;
    out.factors = true;
    return out;
  }
  /// Declares ParamInfo::optical.
  NumberSpec as(Optical what) const {
    NumberSpec out = *this;
    out.optical = what;
    return out;
  }
};
struct ColorSpec {
  const char* name;
  const char* label;
  std::array<double, 3> value;
  const char* doc;
  Optical optical = Optical::None;

  ColorSpec as(Optical what) const {
    ColorSpec out = *this;
    out.optical = what;
    return out;
  }
};
struct ChoiceSpec {
  const char* name;
  const char* label;
  std::vector<std::string> choices;
  const char* doc;
};

namespace detail {

/// Lists what a model declares.
struct SchemaVisitor {
  std::vector<ParamInfo>& out;
  template <class T> void operator()(T&, const NumberSpec& s) const {
    out.push_back({s.name,
                   s.label,
                   s.unit,
                   s.doc,
                   s.min,
                   s.max,
                   s.soft_min,
                   s.soft_max,
                   {s.value, 0, 0},
                   {},
                   ParamKind::Number,
                   s.factors,
                   s.optical});
  }
  template <class T> void operator()(Rgb<T>&, const ColorSpec& s) const {
    out.push_back({s.name, s.label, "", s.doc, 0, 1, 0, 1, s.value, {}, ParamKind::Color, false, s.optical});
  }
  void operator()(Choice&, const ChoiceSpec& s) const {
    out.push_back({s.name,
                   s.label,
                   "",
                   s.doc,
                   0,
                   double(s.choices.size() - 1),
                   0,
                   double(s.choices.size() - 1),
                   {0, 0, 0},
                   s.choices,
                   ParamKind::Choice});
  }
};

}  // namespace detail

}  // namespace brdfc::inline model
