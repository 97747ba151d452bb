// SPDX-License-Identifier: GPL-3.0-or-later
// A representation is a model in a form that Cycles runs: statements that compute closures.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/cosines.h"
#include "model/choices.h"

namespace brdfc::forms {

enum class RepresentationKind {
  Exact,    ///< closures that equal the model
  Aimed,    ///< closures aimed at lamps that carry the model there, and one drawn direction for the rest (aimed.h)
  Sampled,  ///< the shader samples the model itself, one narrow lobe per sample
  Fitted,   ///< closures that come close to the model, for one set of parameters or along a number (fit/fit.h)
  Twin      ///< no shader but Blender's own nodes, close to the model for one set of parameters (fit/twin.h)
};

const char* name_of(RepresentationKind);
/// Made of a fit: for parameters that must be known, but for factors(), those that it has terms by (fit/terms.h), and
/// one number.
inline bool is_fit(RepresentationKind kind) {
  return kind == RepresentationKind::Fitted || kind == RepresentationKind::Twin;
}
/// Throws InputError that lists the known names.
RepresentationKind representation_named(const std::string&);

/// The forms of a model that need nothing known of its materials, preferred first: a fitted one where the model
/// declares what it runs over (ModelProperties::fit_axis).
std::vector<RepresentationKind> representations(const Model&);

/// The values that a form is confined to, beside those that are `fixed`: choices, where the closures of an exact one
/// are known for some alone; of a fit the defaults of all but factors(), what there are terms by and the number that it
/// runs over.
ParamValues form_values(const Model&, RepresentationKind, const ParamValues& fixed = {});

/// What the colours of a ramp still have to be divided by: nothing, their closure's weight by its largest channel or by
/// each.
enum class Division { Done, ByLargest, ByChannel };
struct RecordedClosure {
  ClosureKind kind;
  bool turned;        ///< has a normal of its own
  Tangent stretched;  ///< facets of two roughnesses, and along what
  Division division;
  bool operator==(const RecordedClosure&) const = default;
};
/// Statements of a form for one combination of choices. They read wo_x, wo_y, wo_z, the parameters and, if
/// sampled, u_0, u_1, u_2; and assign what `kind` says.
struct Recording {
  std::string statements;
  std::vector<RecordedClosure> closures;  ///< all but Sampled
  int operations = 0;
  std::vector<std::string> inputs;
  std::vector<std::string> arrays;  ///< declarations of what the statements look up: they may stand further out
};

/// Sampled: assigns wi_x, wi_y, wi_z and weight. Others: what closure i takes of weight_i, ramp_i[8], exponent_i,
/// alpha_i, alpha_across_i, ior_i, and of its normal and tangent, if they are its own, normal_i_x and so on;
/// A form of a fit needs all parameters in
/// `fixed` but one number and what it has terms by, which it reads, and factors(), which its weights still have to be
/// multiplied by, the mirror's excepted; it is right for these `views`. Throws InputError if more closures than Cycles
/// keeps would be needed.
Recording record(const Model&, RepresentationKind, const ParamValues& fixed, int indent, const Cosines& views = {});
/// The statements of an aimed form, for one combination of choices. All read the parameters and wo_x, wo_y, wo_z.
struct AimedRecording {
  Recording base;   ///< assigns what its closures take, as an exact form's
  Recording draw;   ///< reads u_0, u_1, u_2; assigns drawn_x, drawn_y, drawn_z
  Recording value;  ///< reads wi_x, wi_y, wi_z and the base's closures; assigns value and density
};
/// Where the base comes from: the model declares it, or closures fitted to it, which need in `fixed` what a form of a
/// fit needs; such a base leaves out the factors(), and is for these `views`.
enum class AimedBase { Declared, Fitted };
AimedRecording record_aimed(const Model&, const ParamValues& fixed, int indent, AimedBase = AimedBase::Declared,
                            const Cosines& views = {});
/// What is done with each lamp and at the end, which is the same for all models (aimed.h). `lobes` counts the lobes so
/// far: arrays of lamp_* and lobe_* hold their numbers, at `earlier` one of them and at `lobes` the one to come.
struct AimedSteps {
  Recording above;  ///< reads the lamp; assigns lamp_above, how high it reaches
  Recording room;   ///< of `earlier` and the lamp's centre: assigns lobe_room
  Recording aim;    ///< reads the lamp, lobe_room, v_1, v_2, wo_*; assigns wi_*, lamp_emphasis, lamp_solid_angle,
                    ///< lobe_height and of the lobe to_lamp_*, to_half_*, exponent, radius, end and extent
  Recording less;   ///< reads the lobe `earlier` and wi_*; takes it off excess
  Recording send;   ///< reads excess, drawn_density and what aim assigned; assigns the lobe's value, weight and colour
  Recording toss;   ///< assigns tossed, the number of a lobe or less than 0, and u_0
  Recording under;  ///< reads the lobe `chosen`, u_1, u_2; assigns drawn_*
  Recording meet;   ///< adds `earlier` to covered, covered_before, lamp_met and density_under; moves ray_*
  Recording rest;   ///< reads excess, drawn_density, lobes and what meet assigned; assigns rest_weight and rest_colour
  Recording alone;  ///< the same without lamps: reads excess and drawn_density
};
const AimedSteps& aimed_steps(int indent);

/// Assigns mirror_weight, the weight of ideal reflection.
Recording record_mirror(const Model&, const ParamValues& fixed, int indent);

/// The measured error of a form against the model.
struct RepresentationError {
  std::optional<double> relative_l1;  ///< of f cos over directions and parameters; none if equal in expectation only
  std::optional<double> relative_l2;  ///< the same, root of the sums of squares
  double albedo = 0;                  ///< largest |albedo - quadrature| as executed in single precision
  std::string note;
};

/// Executes the recorded form in float at random parameters and directions (fixed seed). Throws ValueError naming
/// model, parameters, directions and value for a result that is NaN, infinite or negative.
/// Of a form of a fit, at the parameters in `fixed`, which the others do without: mean over views with cosines spread
/// evenly and over the number that it runs along, the worst in `note`; of fitted closures over these `views`.
RepresentationError measure_error(const Model&, RepresentationKind, const ParamValues& fixed = {},
                                  const Cosines& views = {});

}  // namespace brdfc::forms
