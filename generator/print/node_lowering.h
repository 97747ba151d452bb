// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "trace/program.h"

namespace brdfc::print {

/// Rewrites the program so that it contains only operations that nodes have: loops are unrolled, and functions that SVM
/// lacks become series. Requires a current recorder, and uses its precision.
Program lowered_to_nodes(const Program&);

}  // namespace brdfc::print
