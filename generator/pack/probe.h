// SPDX-License-Identifier: GPL-3.0-or-later
// A shader that shows the values that Cycles computes with a model's recorded formulas, and the same computations in
// this program, for comparison.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

/// The numbers that a probe shows: f (3), pdf, and for a sample wi (3), weight (3), pdf.
inline constexpr int kProbeNumbers = 11;
using ProbeValues = std::array<double, kProbeNumbers>;

struct ProbePoint {
  ParamValues values;  ///< complete
  Vec3<double> wi, wo, u;
};

/// The source of the shader brdfc_probe for one combination of choices. Its inputs are wi, wo, numbers (u), show (0 f,
/// 1 the sample's wi, 1.5 its pdf, 2 its weight, 3 pdf), and one for each parameter, its name with the prefix "p_". Its
/// output BSDF is an emission. Values that are not finite are shown as kNotFinite.
std::string probe_source(const Model&, const ParamValues& choices);
inline constexpr double kNotFinite = -31337;

/// The ways to compute a point: the model in double and in float, its recording in float, and the recording with OSL's
/// arithmetic.
enum class ProbeRun { Double, Float, Recorded, Osl };
inline constexpr ProbeRun kProbeRuns[] = {ProbeRun::Double, ProbeRun::Float, ProbeRun::Recorded, ProbeRun::Osl};
const char* name_of(ProbeRun);

/// The results of all runs at all points, [point][run].
std::vector<std::array<ProbeValues, 4>> run_probe(const Model&, const ParamValues& choices,
                                                  const std::vector<ProbePoint>&);

}  // namespace brdfc::pack
