// SPDX-License-Identifier: GPL-3.0-or-later
// Error over run time, as SVG.
#pragma once

#include <string>
#include <vector>

#include "report/report.h"

namespace brdfc::report {

/// Appends a chart of all scenes at once: error (logarithmic) over cost (logarithmic), a colour a form. Pointing at a
/// dot says what it is. Nothing for less than two dots.
void put_overview(std::string& out, const std::vector<SceneReport>&);
/// Appends one of a scene: error (logarithmic) over cost, one point a form, the expected noise as a dashed line each.
/// Nothing for less than two forms.
void put_chart(std::string& out, const SceneReport&);

}  // namespace brdfc::report
