// SPDX-License-Identifier: GPL-3.0-or-later
// What of each model a pack holds: everything, or only what the materials of a scene need.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/cosines.h"
#include "forms/form.h"
#include "model/model.h"
#include "plan/costs.h"

namespace brdfc::plan {

/// A material as a scene uses it.
struct MaterialNeed {
  std::string id;                  ///< its name in the scene, for messages and the manifest
  const Model* model = nullptr;    ///< registered; must not be null
  ParamValues values;              ///< a value for every parameter of the model; of textured ones any
  std::set<std::string> textured;  ///< names of parameters that vary over the surface
  /// The form that the material asks for, by name; "auto" leaves the choice to plan_scene().
  std::string representation = "auto";
  Cosines views = {};  ///< between normal and viewer, in [0, 1], at which it can be seen; all unless told
};

/// Why a form of a model is in a pack, or is not.
struct FormChoice {
  const forms::Form* form;
  bool taken = false;          ///< the pack has it
  bool exists = true;          ///< the model has it for the materials' parameters
  std::optional<double> cost;  ///< as Costs has it: CPU time, in units of Blender's Glossy node; none if not measured
  std::string why;             ///< the reason, as a sentence for people
  /// Of a fitted form that is taken, or that a budget asks about: the integral of |fit - model| over the albedo, mean
  /// over views, of the material that is off by most.
  std::optional<double> error = {};
};

/// What a budget makes of the form of a material.
struct FormChange {
  std::string id;                     ///< of the material
  const forms::Form *before, *after;  ///< without a budget, as in a pack of everything; and with it
  /// Of each, in units of Blender's Glossy node; none where they were not measured.
  std::optional<double> cost_before, cost_after;
};

/// What a pack holds of one model.
struct PlannedModel {
  const Model* model = nullptr;                        ///< registered
  std::vector<std::string> materials;                  ///< ids of those that need it; none in a pack of everything
  ParamValues fixed;                                   ///< folded into shaders and tables: they have no sockets
  std::vector<const forms::Form*> forms;               ///< that the pack has, preferred first
  int max_lamps = forms::kMaxLamps;                    ///< how many lamps aimed forms can be told of
  forms::AimedBase base = forms::AimedBase::Declared;  ///< what aimed forms draw beside the lobes towards lamps
  /// Cosines at which one of the materials can be seen: tables and fits have no others.
  Cosines views;
  std::vector<FormChoice> choices;         ///< one for every form, where materials were planned for; else none
  std::vector<FormChange> material_forms;  ///< one for each of `materials`
  std::vector<std::string> reasons;        ///< why something else is left out, a line each
};

/// A pack of everything: whole models, with sockets for all parameters, in every form that they have. Throws InputError
/// for an unknown name; no names: every model.
std::vector<PlannedModel> plan_models(const std::vector<std::string>& names);

/// What a scene may cost. Unless told, nothing is limited and nothing is offered beside what materials ask for.
struct Budget {
  /// Relative L1 of f cos(theta_i), mean over views, that a form may have where the material leaves the form open.
  std::optional<double> error;
  bool offer = false;      ///< a fitted form that would be taken then comes beside a sampled one that is asked for
  bool twin = false;       ///< a twin (fit/twin.h) comes beside the other forms where there can be one
  bool fit_bases = false;  ///< aimed forms have a fit for a base where there can be one
  /// Cost that a form may have where the material leaves the form open, in units of Blender's Glossy node.
  std::optional<double> time = {};
  Costs costs = {};  ///< what forms cost; without them `time` can't choose
  /// Lamps that no drawn direction meets, for they have no size: their places in the file, or names.
  std::vector<std::string> sizeless = {};
  /// How many lamps there are to aim at; none where that is not known.
  std::optional<int> lamps = {};
  /// Blender's own nodes with a model's formulas come beside forms that are left open.
  bool nodes = false;
};

/// The models of the materials, in alphabetical order: a parameter that all materials of a model set to the same
/// constant is fixed, a form that none uses is left out. Throws InputError naming the material for a representation
/// that its model does not have.
/// Where a material leaves its form open, forms stand in this order: exact; fitted, if the budget has an error and the
/// fit keeps it; aimed; fitted, if the budget has a time and no error; sampled.
/// The first is taken that keeps the time, or where none does the one of the least cost that is known.
std::vector<PlannedModel> plan_scene(const std::vector<MaterialNeed>&, const Budget& = {});

}  // namespace brdfc::plan
