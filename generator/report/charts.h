// SPDX-License-Identifier: GPL-3.0-or-later
// Charts of error over run time, as SVG.
#pragma once

#include <string>
#include <vector>

#include "report/report.h"

namespace brdfc::report {

/// Appends a chart of all scenes: error over cost, both on logarithmic axes, with one colour for each form. A tooltip
/// describes each dot. With less than two dots nothing is appended.
void put_overview(std::string& out, const std::vector<SceneReport>&);
/// Appends a chart of one scene: error (logarithmic) over cost, with one point for each form and its expected noise as
/// a dashed line. With less than two forms nothing is appended.
void put_chart(std::string& out, const SceneReport&);

}  // namespace brdfc::report
