// SPDX-License-Identifier: GPL-3.0-or-later
// Models as OSL that stands alone: a shader for Blender's Script node, and formulas for other renderers that run OSL.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

/// Contents by path. No names: every model. Throws InputError for an unknown name, and for a parameter whose name the
/// functions need.
///
/// MODEL.osl: a shader of closures that Cycles has, for a node without the extension's list of lamps: the exact form
/// where there is one for all choices, else the aimed form without lamps. Its output Albedo is left out where it would
/// take large tables.
///
/// include/brdfc_MODEL.h: the formulas as functions, without closures: of a model that scatters brdfc_MODEL_eval, _pdf
/// and _sample; of one with delta terms _mirror, _transmit and _ior, and _transmittance where its inside absorbs. All
/// take every parameter, in the order of the schema. include/brdfc_library.h has what they call.
std::map<std::filesystem::path, std::string> standalone_files(const std::vector<std::string>& names);

}  // namespace brdfc::pack
