// SPDX-License-Identifier: GPL-3.0-or-later
// Recorded programs that compute the inputs of a form's closures from a model's formulas. All read the parameters and
// wo_x, wo_y, wo_z, the viewer's direction in the shader's frame, whose normal is on the viewer's side.
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

/// What the colours of a ramp still have to be divided by: nothing, the largest channel of their closure's weight, or
/// the weight channel by channel.
enum class Division { Done, ByLargest, ByChannel };
struct RecordedClosure {
  ClosureKind kind;
  bool turned;        ///< has its own normal
  Tangent stretched;  ///< for microfacets with two roughnesses: the tangent that they are stretched along
  Division division;
  bool operator==(const RecordedClosure&) const = default;
};

/// The program for one combination of choices.
struct Recording {
  std::shared_ptr<const Program> program;
  std::vector<RecordedClosure> closures;  ///< the closures whose inputs it assigns: see output_closures()
  std::vector<std::string> taken;         ///< names that its statements must not declare

  int operations() const { return program->operations(); }
};

Recording recording_of(Program, std::vector<std::string> taken, std::vector<RecordedClosure> closures = {});
/// The recording of a program in a shader that has the model's parameters.
Recording recording_of(const Model&, Program, std::vector<RecordedClosure> closures = {});

/// The viewer's direction; for a two-sided model, z points outwards.
Vec3<Expr> recorded_wo(const Model&, const Brdf<Expr>&);
/// Converts a direction on the viewer's side to the outward frame of a two-sided model, and back.
Vec3<Expr> turned_to_side(const Model&, const Brdf<Expr>&, Vec3<Expr>);
/// The three numbers u_0, u_1, u_2 that draw a direction.
Vec3<Expr> recorded_u();

/// Transmittance of the medium on the path from the previous hit to this one, of length `distance`.
template <class T> Rgb<T> medium(const Brdf<T>& brdf, const T& side, const T& distance) {
  return select(side < T(0), brdf.transmittance(distance), Rgb<T>(T(1)));
}

/// Assigns the inputs of closure i, as far as it has them: weight_i, ramp_i[8], exponent_i, alpha_i, alpha_across_i,
/// roughness_i, albedo_i, size_i, smooth_i, ior_i, and its own normal and tangent (normal_i_x and so on).
std::vector<RecordedClosure> output_closures(const ClosureSum<Expr>&, Program&, Division = Division::Done);
/// The same closures with those variables as their inputs.
ClosureSum<Expr> input_closures(ClosureSum<Expr>);
/// The name of a ramp's entry.
std::string ramp_entry(std::size_t closure, std::size_t i);

/// The closures of a fit. Parameters of its terms and its axis are inputs unless they are fixed; factors are not
/// applied.
ClosureSum<Expr> recorded_fit(const Model&, const fit::Fit&, const ParamValues& fixed, const Vec3<Expr>& wo);
/// How the colours of a fit's ramps have to be divided.
Division division_of(const fit::Fit&);

/// Assigns wi_x, wi_y, wi_z and weight, from u_0, u_1, u_2: a sample of the model.
void output_sampled(const Model&, const Brdf<Expr>&, Program&);
/// Makes the closures that a form uses for a model.
using RecordClosures = std::function<ClosureSum<Expr>(const Brdf<Expr>&)>;
/// Assigns the inputs of these closures: see output_closures(). Parameters that are not in `fixed` are inputs.
Recording record_closures(const Model&, const ParamValues& fixed, const RecordClosures&, Division = Division::Done);
/// Assigns mirror_weight, the weight of ideal reflection.
Recording record_mirror(const Model&, const ParamValues& fixed);

}  // namespace brdfc::forms
