// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as OSL.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "print/osl_text.h"
#include "trace/program.h"

namespace brdfc::print {

/// Statements that assign every output, indented, after the arrays that its look-ups read. The caller declares the
/// outputs. The statements declare no name in `taken`, no osl_words(), and no name of an input or output. Throws
/// ExprError for operations that OSL does not have.
std::string osl_program(const Program&, int indent, const std::vector<std::string>& taken);

/// The same without the arrays, which must be declared before.
OslText osl_assignments(const Program&, int indent, const std::vector<std::string>& taken);
struct ProgramArray {
  std::string name;
  std::shared_ptr<const Table> table;
};
std::vector<ProgramArray> osl_arrays(const Program&, const std::vector<std::string>& taken);

/// The library functions (print/osl_library.h) that the statements call.
std::set<std::string> library_calls(const Program&);

}  // namespace brdfc::print
