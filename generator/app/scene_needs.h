// SPDX-License-Identifier: GPL-3.0-or-later
// What the materials of a scene need of the extension, for commands that read scenes.
#pragma once

#include <filesystem>
#include <vector>

#include "plan/plan.h"
#include "reference/scene.h"

namespace brdfc::app {

/// Reads a scene as reference::load_scene() does, and refuses forms that its materials can't have.
reference::Scene load_scene(const std::filesystem::path& path);

/// How the materials of a scene use their models; `views` has the angles from which each material is seen, if known.
/// Throws InputError for measured data as such.
std::vector<plan::MaterialNeed> needs_of(const std::vector<reference::Material>& materials,
                                         const std::vector<Cosines>& views = {});

}  // namespace brdfc::app
