// SPDX-License-Identifier: GPL-3.0-or-later
// The contents of a pack for each model: everything, or only what the materials of a scene need.
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

/// A material in a scene.
struct MaterialNeed {
  std::string id;                  ///< its name in the scene, for messages and the manifest
  const Model* model = nullptr;    ///< registered; must not be null
  ParamValues values;              ///< a value for every parameter of the model; for textured ones any value
  std::set<std::string> textured;  ///< names of parameters that vary over the surface
  /// The name of the form that the material asks for; with "auto", plan_scene() chooses.
  std::string representation = "auto";
  Cosines views = {};  ///< cosines in [0, 1] between normal and viewer at which it is visible; by default all
};

/// The reason why a form of a model is in a pack, or is not.
struct FormChoice {
  const forms::Form* form;
  bool taken = false;          ///< the pack has it
  bool exists = true;          ///< the model has it for the materials' parameters
  std::optional<double> cost;  ///< from Costs: CPU time, in units of Blender's Glossy node; nullopt if not measured
  std::string why;             ///< the reason, as a sentence for users
  /// For a fitted form that is taken, or that a budget asks about: the integral of |fit - model| divided by the albedo,
  /// mean over views, for the material with the largest error.
  std::optional<double> error = {};
};

/// The change that a budget makes to the form of a material.
struct FormChange {
  std::string id;                     ///< of the material
  const forms::Form *before, *after;  ///< without a budget, as in a pack of everything; and with it
  /// The costs of both, in units of Blender's Glossy node; nullopt if they were not measured.
  std::optional<double> cost_before, cost_after;
};

/// The contents of a pack for one model.
struct PlannedModel {
  const Model* model = nullptr;                        ///< registered
  std::vector<std::string> materials;                  ///< ids of those that need it; empty in a pack of everything
  ParamValues fixed;                                   ///< constants in shaders and tables: they have no sockets
  std::vector<const forms::Form*> forms;               ///< in the pack, preferred first
  int max_lamps = forms::kMaxLamps;                    ///< number of lamps that aimed forms have slots for
  forms::AimedBase base = forms::AimedBase::Declared;  ///< what aimed forms sample beside the lobes towards lamps
  /// Cosines at which at least one of the materials is visible: tables and fits are limited to these.
  Cosines views;
  std::vector<FormChoice> choices;         ///< one for every form if materials were planned for; else empty
  std::vector<FormChange> material_forms;  ///< one for each of `materials`
  std::vector<std::string> reasons;        ///< reasons why other things are left out, one line each
};

/// The plan for a pack of everything: whole models, with sockets for all parameters, in every form that they have. An
/// empty list of names stands for every model. Throws InputError for an unknown name.
std::vector<PlannedModel> plan_models(const std::vector<std::string>& names);

/// The limits for a scene. By default nothing is limited, and no forms are added to those that materials ask for.
struct Budget {
  /// The largest relative L1 error of f cos(theta_i), mean over views, that a form may have if the material leaves the
  /// form open.
  std::optional<double> error;
  bool offer = false;      ///< adds a fitted form that would be taken, beside a sampled one that a material asks for
  bool twin = false;       ///< adds a twin (fit/twin.h) to the other forms where possible
  bool fit_bases = false;  ///< aimed forms have a fit as their base where possible
  /// The largest cost that a form may have if the material leaves the form open, in units of Blender's Glossy node.
  std::optional<double> time = {};
  Costs costs = {};  ///< costs of forms; without them `time` can't choose
  /// Lamps that no sampled direction can hit, because they have no size: their places in the file, or their names.
  std::vector<std::string> sizeless = {};
  /// The number of lamps to aim at; nullopt if it is not known.
  std::optional<int> lamps = {};
  /// Where a material leaves its form open, also plans the form that runs without Open Shading Language: Blender's own
  /// nodes with the model's formulas.
  bool nodes = false;
};

/// Throws InputError for a form that its model does not have for the values of this material, which names those that it
/// has, after the place in a file. plan_scene() does the same, for the values that all materials of a model share.
void require_form(const MaterialNeed&, const std::string& place);

/// The plan for the models of the materials, in alphabetical order. A parameter that all materials of a model set to
/// the same constant becomes fixed, and forms that no material uses are left out. Throws InputError naming the material
/// for a representation that its model does not have. If a material leaves its form open, forms are tried in this
/// order: exact; fitted, if the budget has an error and the fit is within it; aimed; fitted, if the budget has a time
/// and no error; sampled. The first form within the time limit is taken; if there is none, the one with the lowest
/// known cost.
std::vector<PlannedModel> plan_scene(const std::vector<MaterialNeed>&, const Budget& = {});

}  // namespace brdfc::plan
