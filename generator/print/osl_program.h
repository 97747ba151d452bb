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

/// Statements that assign every output (to variables declared by the caller), indented, after the arrays that look-ups
/// read. The text declares no name of `taken`, as it declares no osl_words(), inputs and outputs. Throws ExprError for
/// what OSL has no words for.
std::string osl_program(const Program&, int indent, const std::vector<std::string>& taken);

/// The same without the arrays, which have to be declared before.
OslText osl_assignments(const Program&, int indent, const std::vector<std::string>& taken);
struct ProgramArray {
  std::string name;
  std::shared_ptr<const Table> table;
};
std::vector<ProgramArray> osl_arrays(const Program&, const std::vector<std::string>& taken);

/// The functions of the library (print/osl_library.h) that the statements call.
std::set<std::string> library_calls(const Program&);

}  // namespace brdfc::print
