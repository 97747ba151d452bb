// SPDX-License-Identifier: GPL-3.0-or-later
// A shader that shows what Cycles makes of a model's recorded formulas, and the same executed here.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::pack {

/// Numbers that a probe shows: f (3), pdf, and of a sample wi (3), weight (3), pdf.
inline constexpr int kProbeNumbers = 11;
using ProbeValues = std::array<double, kProbeNumbers>;

struct ProbePoint {
  ParamValues values;  ///< complete
  Vec3<double> wi, wo, u;
};

/// Source of the shader brdfc_probe for one combination of choices. Its inputs are wi, wo, numbers (u), show (0 f, 1
/// the sample's wi, 1.5 its pdf, 2 its weight, 3 pdf) and one of each parameter's name with "p_" before it; its output
/// BSDF is an emission. What is not finite shows as kNotFinite.
std::string probe_source(const Model&, const ParamValues& choices);
inline constexpr double kNotFinite = -31337;

/// How to execute a point: the model in double and float, its recording in float, and that with OSL's arithmetic.
enum class ProbeRun { Double, Float, Recorded, Osl };
inline constexpr ProbeRun kProbeRuns[] = {ProbeRun::Double, ProbeRun::Float, ProbeRun::Recorded, ProbeRun::Osl};
const char* name_of(ProbeRun);

/// All runs of all points, [point][run].
std::vector<std::array<ProbeValues, 4>> run_probe(const Model&, const ParamValues& choices,
                                                  const std::vector<ProbePoint>&);

}  // namespace brdfc::pack
