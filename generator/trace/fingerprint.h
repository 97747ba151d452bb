// SPDX-License-Identifier: GPL-3.0-or-later
// Telling formulas apart by what they compute, not by how they are printed.
#pragma once

#include <string>

#include "trace/program.h"

namespace brdfc::inline trace {

/// SHA-256, as 64 hexadecimal digits, of all that the outputs of a program of the current recorder compute: operations,
/// inputs, outputs, tables, and constants to nine digits. Equal ones mean equal formulas. It depends neither on the
/// order in which a compiler evaluates arguments, and so nodes are made, nor on names given by named(), nor on which
/// way round a sum or a product is written.
std::string fingerprint(const Program&);

}  // namespace brdfc::inline trace
