// SPDX-License-Identifier: GPL-3.0-or-later
// What of each model a pack holds: everything, or only what the materials of a scene need.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/cosines.h"
#include "forms/aimed.h"
#include "forms/form.h"
#include "model/model.h"
#include "plan/costs.h"

namespace brdfc::plan {

/// A material as a scene uses it.
struct MaterialNeed {
  std::string id;
  const Model* model = nullptr;
  ParamValues values;              ///< complete
  std::set<std::string> textured;  ///< parameters that vary over the surface
  std::string representation = "auto";
  Cosines views = {};  ///< that it can be seen from
};

/// Why a form of a model is in a pack, or is not.
struct FormChoice {
  const forms::Form* form;
  bool taken = false;
  bool exists = true;          ///< for these materials
  std::optional<double> cost;  ///< as Costs has it
  std::string why;
  /// Of a fitted form that is taken, or that a budget asks about: relative L1 of the material that is off by most.
  std::optional<double> error = {};
};

/// What a budget makes of the form of a material.
struct FormChange {
  std::string id;
  const forms::Form *before, *after;              ///< without a budget, as in a pack of everything; and with it
  std::optional<double> cost_before, cost_after;  ///< none where they were not measured
};

/// What a pack holds of one model.
struct PlannedModel {
  const Model* model = nullptr;
  std::vector<std::string> materials;                  ///< that need it; none in a pack of everything
  ParamValues fixed;                                   ///< folded into shaders and tables: no sockets
  std::vector<const forms::Form*> forms;               ///< preferred first
  int max_lamps = forms::kMaxLamps;                    ///< that aimed forms can be told of
  forms::AimedBase base = forms::AimedBase::Declared;  ///< of an aimed form
  Cosines views;                           ///< that one of the materials can be seen from; tables have no others
  std::vector<FormChoice> choices;         ///< every form, where materials were planned for
  std::vector<FormChange> material_forms;  ///< of `materials`
  std::vector<std::string> reasons;        ///< why something else is left out, a line each
};

/// Whole models in every form. Throws InputError for an unknown name; no names: every model.
std::vector<PlannedModel> plan_models(const std::vector<std::string>& names);

/// What a scene may cost.
struct Budget {
  std::optional<double> error;  ///< relative L1 of f cos that a form may have where the material leaves the form open
  bool offer = false;           ///< a fitted form that would be taken then comes beside a sampled one that is asked for
  bool twin = false;            ///< a twin comes beside the other forms where there can be one
  bool fit_bases = false;       ///< aimed forms have a fit for a base where there can be one
  std::optional<double> time = {};  ///< cost that a form may have where the material leaves the form open
  Costs costs = {};
  /// Lamps that no drawn direction meets, for they have no size: their places in the file, or names.
  std::vector<std::string> sizeless = {};
  /// How many lamps there are to aim at; none where that is not known.
  std::optional<int> lamps = {};
};

/// The models of the materials, in alphabetical order: a parameter that all materials of a model set to the same
/// constant is fixed, a form that none uses is left out. Throws InputError naming the material for a representation
/// that its model does not have.
/// Where a material leaves its form open, forms stand in this order: exact; fitted, if the budget has an error and the
/// fit keeps it; aimed; fitted, if the budget has a time and no error; sampled.
/// The first is taken that keeps the time, or where none does the one of the least cost that is known.
std::vector<PlannedModel> plan_scene(const std::vector<MaterialNeed>&, const Budget& = {});

}  // namespace brdfc::plan
