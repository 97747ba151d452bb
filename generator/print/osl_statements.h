// SPDX-License-Identifier: GPL-3.0-or-later
// Statements as OSL.
#pragma once

#include <string>

#include "print/osl_text.h"
#include "print/statement.h"

namespace brdfc::print {

/// Lines of a block so many levels deep.
OslText osl_statements(const Statements&, int level);
std::string osl_value(const Value&);

}  // namespace brdfc::print
