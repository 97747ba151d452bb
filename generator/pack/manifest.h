// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of manifest.json, from which the add-on learns everything about models and forms.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "forms/form.h"
#include "measure/albedo_table.h"
#include "model/model.h"

namespace brdfc::pack {

using Json = nlohmann::ordered_json;

/// All looks that a model may declare, in the order of menus.
Json looks_json();
const char* name_of(ParamKind);
/// A parameter as every output in JSON describes it.
Json parameter_json(const ParamInfo&);
/// The parameters that are not fixed. `needs` of a parameter lists, by choice, the options under which a formula reads
/// it.
Json parameters_json(const Model&, const ParamValues& fixed);
Json values_json(const ParamValues&);
/// ParamInfo::optical of those of these parameters that declare it, by name.
Json optical_json(const Model&, const ParamValues&);
Json error_json(const forms::FormError&);
/// The values of a choice with which a model lets light through, each as an object with one entry; one empty object if
/// that is so with all.
Json through_json(const Model&);
/// The description of an albedo table without the fixed parameters. `file` is the table's image in the pack.
Json table_json(const measure::AlbedoTable&, const std::string& file, const Model&, const ParamValues& fixed);
/// The number that a fit runs over, and its range; null without one.
Json axis_json(const std::optional<fit::FitAxis>&);
/// The brightness of a form's highlight: f cos near the mirror direction, for the brighter of two views; and the number
/// whose slider it depends on, if any. The brighter the highlight, the sooner clamping of indirect light becomes
/// visible. Null for a form in which clamping does not become visible that way.
Json highlight_json(const Model&, const forms::Form&, const forms::Shader&, const ParamValues& fixed);

}  // namespace brdfc::pack
