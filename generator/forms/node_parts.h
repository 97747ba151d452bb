// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the form made of nodes that are the same for all models, and the JSON of a part.
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "closures/closure.h"
#include "model/model.h"
#include "print/node_program.h"

namespace brdfc::forms {

/// Names of the inputs and outputs of parts that are vectors.
const std::set<std::string>& node_vectors();
nlohmann::ordered_json json_of(const print::NodeProgram&);
/// The extension's name of the node that makes a closure. Throws std::logic_error if none does.
const char* kind_of(ClosureKind);
/// The ranges of the numbers and colours that are not fixed, by name, as links may give them any value.
nlohmann::ordered_json bounds_json(const ModelInfo&, const ParamValues& fixed);

print::NodeProgram record_bend();
print::NodeProgram record_raise();
print::NodeProgram record_axes();
print::NodeProgram record_cone();
/// The part of a flat lamp that shines on the shading point.
print::NodeProgram record_lit();
/// The cone of a lamp with this index.
print::NodeProgram record_count();
print::NodeProgram record_cone_at();
print::NodeProgram record_aside();
print::NodeProgram record_flat();
/// The light of a spot from the point where the model's value is taken, divided by its mean over the cone.
print::NodeProgram record_beam();
print::NodeProgram record_met();
print::NodeProgram record_lobe();
/// The weight of the drawn direction, its value divided by its density. `lost` is the part of its light that a lamp's
/// closure carries, and 1 below the surface.
print::NodeProgram record_rest();

}  // namespace brdfc::forms
