// SPDX-License-Identifier: GPL-3.0-or-later
// The declaration of a model: its name and paper, the claims about it, and its parameters, which it declares by
// specifications (NumberSpec and others) to a visitor; and parameter values as text.
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

/// The optical property that a parameter describes (model/optical.h).
enum class Optical {
  None,
  Index,       ///< n at the d line, of a transparent substance
  Dispersion,  ///< 20 divided by the Abbe number, likewise
  IndexRed,
  IndexGreen,
  IndexBlue,
  ExtinctionRed,
  ExtinctionGreen,
  ExtinctionBlue,
  Reflectance,  ///< at normal incidence: a colour, or a number for a substance that is not a metal
  Tint,         ///< the same where only a metal has one: glass has its index instead
  Attenuation,  ///< share of the light that remains after a stated thickness, where the inside absorbs
  PerLength,    ///< one over that thickness
};
/// "index_r"; "" for None.
const char* name_of(Optical);

/// A parameter: the single source for the command line, manifest, sockets, tests and documentation.
struct ParamInfo {
  std::string name;                      ///< identifier, as in `name=value`
  std::string label;                     ///< shown to users
  std::string unit;                      ///< "" for a pure number, "rad", ...
  std::string doc;                       ///< tooltip: one sentence
  double min = 0, max = 1;               ///< accepted range, inclusive
  double soft_min = 0, soft_max = 1;     ///< the range of a slider; must lie inside [min, max]
  std::array<double, 3> value{0, 0, 0};  ///< default; a Number uses element 0, a Choice its index
  std::vector<std::string> choices;      ///< identifiers, for a Choice
  ParamKind kind = ParamKind::Number;
  /// True if the parameter's effect depends on ratios of its values rather than on differences.
  bool by_factors = false;
  /// Of a Color: whether it may be larger than `max` where a texture says so, as it only scales light.
  bool may_exceed = true;
  Optical optical = Optical::None;
  /// The panel of a node, closed at first, that this parameter is in; "" if it is in none.
  std::string panel = "";

  /// The scale and range of the slider, and of all accepted values.
  ScaledRange slider() const;
  ScaledRange accepted() const;
};

/// A choice under which f uses tables of an integral instead of a formula for it.
struct TabulatedChoice {
  std::string parameter, choice;
  double error = 0;  ///< largest deviation of the albedo from its claim due to interpolation; 0: no such choice
};

/// A choice whose factor for interreflection depends on the viewer alone.
struct CompensatedChoice {
  std::string parameter, choice;
};

/// Claims of the paper or of this project about a model. Tests try to prove each claim, also the negative ones.
struct ModelProperties {
  bool reciprocal = true;      ///< f(wi, wo) = f(wo, wi)
  bool conserving = true;      ///< albedo <= 1 for every view direction and admissible parameter
  bool lossless = false;       ///< albedo = 1 (colours at 1, no other loss) for every view direction
  bool isotropic = true;       ///< unchanged when both directions are rotated about the normal
  bool positive = true;        ///< f > 0 for all directions above the surface, colours > 0, inside the sliders' ranges
  bool smooth = true;          ///< first derivatives of f are continuous above the surface: no visible edges
  bool exact_sampling = true;  ///< the pdf of sample() is proportional to f cos: its weight does not depend on wi
  /// Assignments ("n=0") that make f constant, in the syntax of parse_values(), separated by spaces; "" if there are
  /// none.
  std::string diffuse_limit = "";
  /// Assignments ("n=1e8") for which nearly all light is reflected in the mirror direction; "" if there are none.
  std::string specular_limit = "";
  TabulatedChoice tabulated = {};
  CompensatedChoice compensated = {};  ///< `reciprocal` and `conserving` do not apply to it
  /// False if no table can hold the albedo, because the model has too many parameters, or because the albedo is not a
  /// polynomial of degree two in a colour. There is no Albedo output then.
  bool albedo_table = true;
  /// The number along which the repository stores a fit (fit/fit.h), with factors and mixed parameters open and the
  /// others at their defaults; "" if there is none.
  std::string fit_axis = "";
};

/// The main appearance of a model, by which menus group models.
enum class Look { Undeclared, Matte, Glossy, Metal, Glass, Special };
/// "matte", "glossy", ...
std::string name_of(Look);

/// All members have initialisers, so that info() may omit those that do not apply.
struct ModelInfo {
  std::string name = {};   ///< identifier
  std::string label = {};  ///< shown to users
  Look look = Look::Undeclared;
  std::string paper = {};      ///< citation, "I. Name, J. Name: Title, Journal, year"
  std::string equations = {};  ///< "eqs. 10, 14, 16, 19, 20"
  std::string doc = {};        ///< one or two sentences
  ModelProperties properties = {};
  std::vector<ParamInfo> params = {};

  /// The parameter with this name; nullptr if there is none.
  const ParamInfo* param(const std::string& name) const;
};

using ParamValue = std::variant<double, std::array<double, 3>, std::string>;
/// Values by name; a missing parameter has its default.
using ParamValues = std::map<std::string, ParamValue>;

/// Checks names, kinds and ranges, and returns a value for every parameter. Throws InputError.
ParamValues complete(const ModelInfo&, const ParamValues&);
/// Reads "name=value" (colours as r,g,b or one grey number). Throws InputError.
ParamValues parse_values(const ModelInfo&, const std::vector<std::string>& assignments);
/// The error that the model declares for a tabulated choice; 0 if these values do not select it.
double table_error(const ModelInfo&, const ParamValues&);
/// Whether these values select the model's compensated choice.
bool is_compensated(const ModelInfo&, const ParamValues&);
/// The values as text in the syntax of parse_values(), with parameters in schema order.
std::string format_values(const ModelInfo&, const ParamValues&);

/// The index of an option among the parameter's choices; it is fixed while a formula is recorded.
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
  const char* panel = "";

  /// The same specification with ParamInfo::by_factors set.
  NumberSpec by_factors() const {
    NumberSpec out = *this;
    out.factors = true;
    return out;
  }
  /// The same specification with ParamInfo::optical set.
  NumberSpec as(Optical what) const {
    NumberSpec out = *this;
    out.optical = what;
    return out;
  }
  /// The same specification with ParamInfo::panel set.
  NumberSpec in(const char* which) const {
    NumberSpec out = *this;
    out.panel = which;
    return out;
  }
};
struct ColorSpec {
  const char* name;
  const char* label;
  std::array<double, 3> value;
  const char* doc;
  Optical optical = Optical::None;
  const char* panel = "";
  bool may_exceed = true;

  ColorSpec as(Optical what) const {
    ColorSpec out = *this;
    out.optical = what;
    return out;
  }
  /// A color above 1 has no meaning.
  ColorSpec at_most_one() const {
    ColorSpec out = *this;
    out.may_exceed = false;
    return out;
  }
  ColorSpec in(const char* which) const {
    ColorSpec out = *this;
    out.panel = which;
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

/// Collects the parameters that a model declares.
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
                   true,
                   s.optical,
                   s.panel});
  }
  template <class T> void operator()(Rgb<T>&, const ColorSpec& s) const {
    out.push_back({s.name,
                   s.label,
                   "",
                   s.doc,
                   0,
                   1,
                   0,
                   1,
                   s.value,
                   {},
                   ParamKind::Color,
                   false,
                   s.may_exceed,
                   s.optical,
                   s.panel});
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
