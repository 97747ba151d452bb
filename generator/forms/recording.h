// SPDX-License-Identifier: GPL-3.0-or-later
// What a form's closures take, as recorded programs of a model's formulas. All read the parameters and wo_x, wo_y,
// wo_z, the viewer's direction in the shader's frame, whose normal is on the viewer's side.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "closures/closure.h"
#include "fit/fit.h"
#include "model/model.h"
#include "trace/expr.h"
#include "trace/program.h"

namespace brdfc::forms {

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

/// What is computed for one combination of choices.
struct Recording {
  std::shared_ptr<const Program> program;
  std::vector<RecordedClosure> closures;  ///< whose numbers it assigns: see output_closures()
  std::vector<std::string> taken;         ///< names that its statements may not declare

  int operations() const { return program->operations(); }
};

Recording recording_of(Program, std::vector<std::string> taken, std::vector<RecordedClosure> closures = {});
/// The same where a shader has the model's parameters.
Recording recording_of(const Model&, Program, std::vector<RecordedClosure> closures = {});

/// The viewer's direction, for a model of two sides with z turned outwards.
Vec3<Expr> recorded_wo(const Model&, const Brdf<Expr>&);
/// From a direction above the surface on the viewer's side to one of a model of two sides, and back.
Vec3<Expr> turned_to_side(const Model&, const Brdf<Expr>&, Vec3<Expr>);
/// The three numbers u_0, u_1, u_2 that draw a direction.
Vec3<Expr> recorded_u();

/// What the medium has left of the light that comes from this hit; `distance` is that to the hit before.
template <class T> Rgb<T> medium(const Brdf<T>& brdf, const T& side, const T& distance) {
  return select(side < T(0), brdf.transmittance(distance), Rgb<T>(T(1)));
}

/// Assigns what closure i takes of weight_i, ramp_i[8], exponent_i, alpha_i, alpha_across_i, roughness_i, albedo_i,
/// size_i, smooth_i, ior_i, and of its normal and tangent, if they are its own, normal_i_x and so on.
std::vector<RecordedClosure> output_closures(const ClosureSum<Expr>&, Program&, Division = Division::Done);
/// The same closures with these variables for their numbers.
ClosureSum<Expr> input_closures(ClosureSum<Expr>);
/// The name of an entry of a closure's ramp.
std::string ramp_entry(std::size_t closure, std::size_t i);

/// A fit's closures. What it has terms by, and its axis, are inputs unless they are fixed; factors are left out.
ClosureSum<Expr> recorded_fit(const Model&, const fit::Fit&, const ParamValues& fixed, const Vec3<Expr>& wo);
/// What ramps of a fit have to be divided by.
Division division_of(const fit::Fit&);

/// Assigns wi_x, wi_y, wi_z and weight, from u_0, u_1, u_2: the model's own sample.
void output_sampled(const Model&, const Brdf<Expr>&, Program&);
/// What closures a form makes of a model.
using RecordClosures = std::function<ClosureSum<Expr>(const Brdf<Expr>&)>;
/// Assigns what they take: see output_closures(). What `fixed` lacks is an input.
Recording record_closures(const Model&, const ParamValues& fixed, const RecordClosures&, Division = Division::Done);
/// Assigns mirror_weight, the weight of ideal reflection.
Recording record_mirror(const Model&, const ParamValues& fixed);

}  // namespace brdfc::forms
