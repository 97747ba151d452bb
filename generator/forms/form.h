// SPDX-License-Identifier: GPL-3.0-or-later
// A form is a way to bring a model to Cycles: a shader, or a tree of Blender's nodes. Each is a file of this folder
// that implements Form, and a line in registry.cpp. What else there is, the plan, the pack, the command line, asks
// forms here and knows none by name.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/cosines.h"
#include "fit/fit.h"
#include "fit/roles.h"
#include "forms/aimed.h"
#include "forms/recording.h"
#include "forms/shader.h"
#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::forms {

/// Where the base of a form that aims at lamps comes from: the model declares it, or closures are fitted to the model.
enum class AimedBase { Declared, Fitted };

/// What a form is made for.
struct Setting {
  ParamValues fixed = {};  ///< folded into the text: no parameters of the shader
  Cosines views = {};      ///< of the viewer, that it is right for
  int max_lamps = kMaxLamps;
  AimedBase base = AimedBase::Declared;
};

/// The measured error of a form against the model.
struct FormError {
  std::optional<double> relative_l1;  ///< of f cos over directions and parameters; none if equal in expectation only
  std::optional<double> relative_l2;  ///< the same, root of the sums of squares
  double albedo = 0;                  ///< largest |albedo - quadrature| as executed in single precision
  std::string note;
};

class Form {
 public:
  /// When a form is taken for a material that leaves its form open.
  enum class When {
    Always,        ///< wherever the model has it, unless a form that comes before it in forms() is taken
    WithinBudget,  ///< where a budget names an error and off_by() keeps it, or a time
    Asked          ///< never
  };

  explicit Form(std::string name) : name_(std::move(name)) {}
  virtual ~Form() = default;
  Form(const Form&) = delete;
  Form& operator=(const Form&) = delete;

  /// In files, tables and the manifest, and for a material's `representation`.
  const std::string& name() const { return name_; }

  /// @name Who has it
  /// @{
  virtual When when() const { return When::Always; }
  /// Whether a pack of everything has it of this model.
  virtual bool in_whole_pack(const Model&) const = 0;
  /// Whether it is made for given values, all but those of parameters whose role it serves.
  virtual bool made_of_fit() const { return false; }
  /// Whether parameters of this role may be anything.
  virtual bool serves(fit::Role) const { return true; }
  /// The values that it is confined to, beside those that are fixed.
  virtual ParamValues values(const Model&, const ParamValues& /*fixed*/) const { return {}; }
  /// Why a model with these values has it not, as the rest of a sentence; nothing if it has.
  virtual std::optional<std::string> why_not(const Model&, const ParamValues& /*fixed*/) const { return {}; }
  /// @}

  /// @name What it is like
  /// @{
  /// Whether it sends rays in directions that it draws.
  virtual bool draws() const { return false; }
  /// Whether it aims at lamps: then it has slots for them, and a base.
  virtual bool aims() const { return false; }
  /// Whether it is Blender's own nodes, a JSON file, and no shader.
  virtual bool native() const { return false; }
  /// How lamps without a size shine on it, as the rest of a sentence, where a scene has so many and it aims at up to
  /// `slots`; empty where they do as on Blender's own nodes. Measured by script/conditions.
  virtual std::string under_sizeless_lamps(int /*lamps*/, int /*slots*/) const { return {}; }
  /// Executes the form in single precision at random parameters and directions, always the same; or says what is known
  /// of a fit at the fixed values: mean over views with cosines spread evenly and over its axis, the worst in `note`.
  /// Throws ValueError naming model, parameters, directions and value for one that is NaN, infinite or negative.
  virtual FormError error(const Model&, const Setting&) const = 0;
  /// Of a form that a budget may take: relative L1, mean over views, at this value of the fit's axis, or at the worst.
  virtual std::optional<double> off_by(const Model&, const Setting&, const std::optional<double>& /*axis*/) const {
    return {};
  }
  /// Whether the costs that script/bench measures are those of the form with this setting.
  virtual bool cost_is_measured(const Setting&) const { return true; }
  /// What its closures are looked up in, made at first use; nullptr for a form without tables of its own.
  virtual const fit::Fit* fit(const Model&, const Setting&) const { return nullptr; }
  /// The number that what is fitted runs over, where one does.
  virtual std::optional<fit::FitAxis> axis(const Model& model, const Setting& setting) const {
    const fit::Fit* made = made_of_fit() ? fit(model, setting) : nullptr;
    return made ? made->axis() : std::nullopt;
  }
  /// Makes or reads what it is made of, so that asking for it takes no time afterwards.
  virtual void prepare(const Model& model, const Setting& setting) const { fit(model, setting); }
  /// @}

  /// @name What a pack holds of it
  /// @{
  /// `table` gives the Albedo output, in a shader of its own where its text is longer than kMaxAlbedoText. Throws
  /// InputError if the closures would exceed what Cycles keeps or the table what an array holds, and for fixed values
  /// that differ from values().
  virtual Shader write(const Model&, const measure::AlbedoTable& table, const Setting& = {}) const = 0;
  /// What is recorded of a model for one combination of choices, which `values` have; nothing for nodes.
  virtual std::vector<Recording> recordings(const Model&, const ParamValues& /*values*/, const Setting& = {}) const {
    return {};
  }
  /// What a user must know of it; the add-on turns each into words where it applies.
  virtual std::vector<std::string> warnings(const Model&, const Shader&) const = 0;
  /// Whether a clamp on light shows in it by how bright its highlight is.
  virtual bool highlights(const Model&, const Shader&) const { return false; }
  /// @}

 private:
  std::string name_;
};

/// All forms, preferred first.
const std::vector<const Form*>& forms();
/// Throws InputError that lists the known names.
const Form* form(const std::string& name);
/// Those that a pack of everything has of a model, preferred first.
std::vector<const Form*> forms_of(const Model&);

}  // namespace brdfc::forms
