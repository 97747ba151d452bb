// SPDX-License-Identifier: GPL-3.0-or-later
// Labels of forms and scenes on the report page.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "report/report.h"

namespace brdfc::report {

/// True if the form is one of Blender's own nodes.
bool is_native(const FormReport&);
/// The form's name for people.
std::string label(const FormReport&);
/// Names of all forms in these scenes: Blender's own nodes first, then the others in order of appearance.
std::vector<std::string> all_forms(const std::vector<SceneReport>&);
/// True if the form is on the Pareto front of the scene: no other form is better in error or time without being worse
/// in the other.
bool on_front(const SceneReport&, const FormReport&);
/// Models of all forms of a scene, as words for the page's filter.
std::set<std::string> models_of(const SceneReport&);
/// The HTML attribute that the page's filter reads.
std::string marked(const SceneReport&);

}  // namespace brdfc::report
