// SPDX-License-Identifier: GPL-3.0-or-later
// Models as self-contained OSL: a shader for Blender's Script node, and formulas for other renderers that run OSL.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

/// Contents by path. An empty list of names stands for every model. Throws InputError for an unknown name, and for a
/// parameter whose name the functions need themselves.
///
/// MODEL.osl is a shader of Cycles closures, for a node without the extension's list of lamps: the exact form if there
/// is one for all choices, otherwise the aimed form without lamps. Its Albedo output is left out if it would need large
/// tables.
///
/// include/brdfc_MODEL.h has the formulas as functions, without closures. A model that scatters has brdfc_MODEL_eval,
/// _pdf and _sample; one with delta terms has _mirror, _transmit and _ior, and _transmittance if its inside absorbs.
/// All take every parameter, in the order of the schema. include/brdfc_library.h has the functions that they call.
std::map<std::filesystem::path, std::string> standalone_files(const std::vector<std::string>& names);

}  // namespace brdfc::pack
