// SPDX-License-Identifier: GPL-3.0-or-later
// Prints statements as OSL.
#pragma once

#include <string>

#include "print/osl_text.h"
#include "print/statement.h"

namespace brdfc::print {

/// The lines of a block, indented by `level` levels.
OslText osl_statements(const Statements&, int level);
std::string osl_value(const Value&);

}  // namespace brdfc::print
