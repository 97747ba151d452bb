// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of manifest.json, which is all that the add-on knows of models and forms.
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

/// Every look that a model may declare, in the order of menus.
Json looks_json();
/// Of what is not fixed. `needs` of one: by choice, those without which no formula reads it.
Json parameters_json(const Model&, const ParamValues& fixed);
Json values_json(const ParamValues&);
/// ParamInfo::optical of those of these parameters that have any, by name.
Json optical_json(const Model&, const ParamValues&);
Json error_json(const forms::FormError&);
/// Without what is fixed. `file`: where the pack has the table as an image.
Json table_json(const measure::AlbedoTable&, const std::string& file, const Model&, const ParamValues& fixed);
/// The number that a fit runs over, and how far; null without one.
Json axis_json(const std::optional<fit::FitAxis>&);
/// How bright a form's highlight is: f cos about the mirror direction, the brighter of two views; and over which number
/// of its sliders, if any. A clamp on indirect light shows the earlier the brighter it is. Null for a form in which a
/// clamp does not show by that.
Json highlight_json(const Model&, const forms::Form&, const forms::Shader&, const ParamValues& fixed);

}  // namespace brdfc::pack
