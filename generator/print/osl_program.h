// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as OSL.
#pragma once

#include <string>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// Statements that assign every output (to variables declared by the caller), indented. The text declares no name of `taken`, as it declares no osl_words(), inputs
/// and outputs. The arrays that look-ups read come first or, one text each, in `arrays`. Throws ExprError for what OSL
/// has no words for.
std::string osl_program(const Program&, int indent, const std::vector<std::string>& taken,
                        std::vector<std::string>* arrays = nullptr);

}  // namespace brdfc::print
