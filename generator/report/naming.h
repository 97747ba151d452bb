// SPDX-License-Identifier: GPL-3.0-or-later
// What the page calls forms and scenes, and what it marks them with.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "report/report.h"

namespace brdfc::report {

/// Is the form one of Blender's own nodes?
bool is_native(const FormReport&);
/// What people call it.
std::string label(const FormReport&);
/// Names of all forms of some scenes: Blender's own nodes first, else as they come.
std::vector<std::string> all_forms(const std::vector<SceneReport>&);
/// Pareto: no form of the scene is better in error and not worse in time, or the other way round.
bool on_front(const SceneReport&, const FormReport&);
/// Models of all forms of a scene, as words for the filter.
std::set<std::string> models_of(const SceneReport&);
/// The attribute that the filter looks at.
std::string marked(const SceneReport&);

}  // namespace brdfc::report
