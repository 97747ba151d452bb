// SPDX-License-Identifier: GPL-3.0-or-later
// Fits of sums of lobes to a measured BRDF. M. Radziszewski and W. Alda offer their models as a basis for that.
//
// One lobe after another is added, the one of all kinds with which the sum comes closest when all colours are found
// anew: orthogonal matching pursuit. Y. Pati, R. Rezaiifar, P. Krishnaprasad: Orthogonal Matching Pursuit, Asilomar
// 1993. Then the numbers of all lobes are searched together, and each lobe is exchanged where another one does better.
// What is left may be due to a first choice, so a second pursuit does without the model of the strongest highlight.
// The error is that of fit_models.h.
#pragma once

#include <functional>

#include "measured/brightest.h"
#include "measured/lobe_kinds.h"
#include "measured/measured_model.h"
#include "measured/sum_model.h"

namespace brdfc::measured {

struct LobeSum {
  std::vector<Lobe> lobes;    ///< those that reflect most light first
  std::vector<double> share;  ///< of the light of the sum, by lobe
  double error = 0;           ///< share of the light that is misplaced
  Brightest brightest;
  double seconds = 0;  ///< since the fit of sums began
};

/// The best sums that were found of 1, 2, ... `most` lobes; each has a smaller error than the one before. There are
/// fewer where another lobe no longer helps, and none for black data. Where the data reflect no more light than comes,
/// neither does a sum, unless that would cost much: `brightest` says. `progress`, if there is one, is called with the
/// number of steps that are done, of lobe_steps().
std::vector<LobeSum> fit_lobes(const Measurement&, const MeasuredModel&, const std::vector<LobeKind>&, std::size_t most,
                               const std::function<void(std::size_t)>& progress = {});
inline constexpr std::size_t lobe_steps(std::size_t most) { return 2 * most; }

}  // namespace brdfc::measured
