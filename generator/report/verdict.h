// SPDX-License-Identifier: GPL-3.0-or-later
// What the measurements of a report mean: labels of forms, which pictures differ from their reference, which forms are
// worth their time.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "report/report.h"

namespace brdfc::report {

/// True if the form is one of Blender's own nodes.
bool is_native(const std::string& form);
/// The form's name for people.
std::string label(const std::string& form);
/// Names of all forms in these scenes: Blender's own nodes first, then the others in order of appearance.
std::vector<std::string> all_forms(const std::vector<SceneReport>&);
/// Models of all forms of a scene.
std::set<std::string> models_of(const SceneReport&);
/// The form that materials have by default, the main subject of a report about one scene; nullptr if it was not
/// rendered.
const FormReport* default_form(const SceneReport&);
/// True if the picture differs from the reference by more than noise: by Welch's test, or by the bias of a single
/// image.
bool differs(const FormReport&);
/// True if the form is on the Pareto front of the scene: no other form is better in error or time without being worse
/// in the other.
bool on_front(const SceneReport&, const FormReport&);

/// The result of a whole report.
struct Verdict {
  int judged = 0;             ///< scenes that were rendered in the default form of their materials
  int same = 0;               ///< of these, scenes in which that form's picture does not differ from the reference
  std::vector<double> costs;  ///< of that form in each scene where it is known, in increasing order
  /// The form with the largest significant bias, and its scene; nullptr if there is none. Blender's own nodes do not
  /// count.
  const SceneReport* worst_scene = nullptr;
  const FormReport* worst = nullptr;
};
/// The verdict points into `scenes`.
Verdict verdict_of(const std::vector<SceneReport>& scenes);

}  // namespace brdfc::report
