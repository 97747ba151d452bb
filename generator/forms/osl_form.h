// SPDX-License-Identifier: GPL-3.0-or-later
// What all forms that are shaders share: the shader around what one of them makes of the model.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "forms/choice_switch.h"
#include "forms/form.h"
#include "forms/recording.h"
#include "print/statement.h"

namespace brdfc::forms {

/// A shader as it is being made.
struct ShaderBody {
  const Model& model;
  const Setting& setting;  ///< with the form's own values among what is fixed
  Shader shader = {};
  SharedArrays arrays = {};
  print::Statements statements = {};     ///< after the frame is known, before BSDF is assigned
  std::vector<print::Value> terms = {};  ///< closures, the sum of which is BSDF

  /// Records once for each combination of choices that what is fixed admits, together with what is fixed. Returns the
  /// closures, which are the same for all that have any, and counts the operations of the longest.
  std::vector<RecordedClosure> record(ChoiceSwitch&,
                                      const std::function<Recording(const Choices&, const ParamValues&)>& recording);
  /// Declares what recorded statements assign of the closures, makes them terms and counts what they take. `diffuse_n`:
  /// the variable that Diffuse closures have for their normal.
  void declare(const std::vector<RecordedClosure>&, const std::string& diffuse_n = "frame_n");
  /// Divides colours of ramps as they ask for; then weights are multiplied by the `factors`, that of a mirror is not.
  void scale(const std::vector<RecordedClosure>&, const std::set<std::string>& factors);
  /// Brings normals and tangents of their own from the model's frame into the shader's.
  void turn(const std::vector<RecordedClosure>&);

  void add(print::Statement statement) { statements.push_back(std::move(statement)); }
  void add(print::Statements more) { append(statements, std::move(more)); }
};

class OslForm : public Form {
 public:
  using Form::Form;
  Shader write(const Model&, const measure::AlbedoTable&, const Setting& = {}) const final;

 protected:
  /// Makes statements and terms of all but the mirror of a form that draws(). Here of the closures that recordings()
  /// assign, its first.
  virtual void make_closures(ShaderBody&) const;
  /// The lowest view, as a cosine, that its closures are for: of a lower one the normal is turned; 0: any.
  virtual double lowest_view() const { return 0; }
};

/// Only ramps take more slots than closures.
inline bool has_ramps(const Shader& shader) { return shader.slots > shader.closures; }

/// Codes of what changes the light of Cycles' own closures and of a mirror beside them.
std::vector<std::string> warnings_of_closures(const Model&, const Shader&);

/// Declares u_0, u_1, u_2: three numbers in [0, 1) that draw a direction.
print::Statements declare_draws();

/// A direction of the frame in the coordinates of the scene.
print::Value in_scene(print::Value x, print::Value y, print::Value z);
/// The same of name_x, name_y and name_z.
print::Value in_scene(const std::string& name);

/// Sets a weight to 0 where the vector `wi` of this name leaves on the viewer's side of the shading normal but goes
/// below the true surface. Cycles ends such a path; with Bump Map Correction it would send it along the surface.
print::Statement lost_below(const Model&, const std::string& wi, const std::string& weight);

/// How the shading normal is bent (model/horizon.h): whether it has to be, and to what. None for a matte model, which
/// has no mirror direction; Blender's Diffuse node leaves its normal as it is, too.
std::vector<Recording> record_bending(const Model&);

/// What a drawn direction, which is a lobe, takes of a GPU's pool. Where it may be another closure, OSL makes a product
/// of that and its weight.
int ray_bytes(const Model&);

}  // namespace brdfc::forms
