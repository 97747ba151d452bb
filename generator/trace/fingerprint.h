// SPDX-License-Identifier: GPL-3.0-or-later
// Identifies formulas by what they compute, regardless of how they are printed.
#pragma once

#include <string>

#include "trace/program.h"

namespace brdfc::inline trace {

/// SHA-256, as 64 hexadecimal digits, of everything that the outputs of a program compute: operations, inputs, outputs,
/// tables, and constants to nine digits. Equal fingerprints mean equal formulas. The fingerprint does not depend on the
/// order of the nodes (which depends on the order in which a compiler evaluates arguments), on names given by named(),
/// or on the order of operands in sums and products.
std::string fingerprint(const Program&);

}  // namespace brdfc::inline trace
