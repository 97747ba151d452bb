// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "trace/program.h"

namespace brdfc::print {

/// The program with the operations alone that nodes have: loops unrolled, series for what SVM lacks. There has to be a
/// recorder, whose precision it takes.
Program lowered_to_nodes(const Program&);

}  // namespace brdfc::print
