// SPDX-License-Identifier: GPL-3.0-or-later
// Base class of all forms that are shaders: it writes the shader around the closures of the form.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "forms/choice_switch.h"
#include "forms/form.h"
#include "forms/recording.h"
#include "print/statement.h"

namespace brdfc::forms {

/// A shader under construction.
struct ShaderBody {
  const Model& model;
  const Setting& setting;  ///< the fixed values include those that the form requires
  Shader shader = {};
  SharedArrays arrays = {};
  print::Statements statements = {};     ///< between the frame's declarations and the assignment of BSDF
  std::vector<print::Value> terms = {};  ///< the closures whose sum is BSDF
  /// What BSDF is where the variable `whole` is not 0; the statements above are left out then.
  std::optional<print::Value> whole = {};
  print::Statements of_whole = {};  ///< assigns the variables of `whole`

  /// Records once for each combination of choices that the fixed values allow; the callback gets the combination
  /// together with the fixed values. Returns the closures, which must be the same for all combinations that have any,
  /// and counts the operations of the longest one.
  std::vector<RecordedClosure> record(ChoiceSwitch&,
                                      const std::function<Recording(const Choices&, const ParamValues&)>& recording);
  /// Declares the variables that recorded statements assign for the closures, adds the closures to `terms` and counts
  /// their memory. `diffuse_n`: the variable with the normal of Diffuse closures.
  void declare(const std::vector<RecordedClosure>&, const std::string& diffuse_n = "frame_n");
  /// Divides the colours of ramps as their Division says, and multiplies all weights except a mirror's by `factors`.
  void scale(const std::vector<RecordedClosure>&, const std::set<std::string>& factors);
  /// Transforms the closures' own normals and tangents from the model's frame into the scene.
  void turn(const std::vector<RecordedClosure>&);

  void add(print::Statement statement) { statements.push_back(std::move(statement)); }
  void add(print::Statements more) { append(statements, std::move(more)); }
};

class OslForm : public Form {
 public:
  using Form::Form;
  Shader write(const Model&, const measure::AlbedoTable&, const Setting& = {}) const final;

 protected:
  /// Adds the statements and terms of the form, without the mirror of a form that draws(). By default these are the
  /// closures assigned by the first of recordings().
  virtual void make_closures(ShaderBody&) const;
  /// The lowest cosine of the view that its closures support; for lower views the normal is turned. 0: any view.
  virtual double lowest_view() const { return 0; }
};

/// Only ramps take more slots than there are closures.
inline bool has_ramps(const Shader& shader) { return shader.slots > shader.closures; }

/// Codes of the settings that change the light of Cycles' closures, and of a mirror beside them.
std::vector<std::string> warnings_of_closures(const Model&, const Shader&);

/// Declares u_0, u_1, u_2: three random numbers in [0, 1) for drawing a direction.
print::Statements declare_draws();

/// Transforms a direction of the shader's frame into the coordinates of the scene.
print::Value in_scene(print::Value x, print::Value y, print::Value z);
/// The same for name_x, name_y and name_z.
print::Value in_scene(const std::string& name);

/// Sets `weight` to 0 if the vector `wi` lies on the viewer's side of the shading normal but below the true surface.
/// Cycles ends such a path; with Bump Map Correction it would continue it along the surface.
print::Statement lost_below(const Model&, const std::string& wi, const std::string& weight);

/// Computes whether the shading normal has to be bent, and the bent normal (model/horizon.h). Empty for a matte model,
/// which has no mirror direction; Blender's Diffuse node leaves its normal unchanged, too.
std::vector<Recording> record_bending(const Model&);

}  // namespace brdfc::forms
