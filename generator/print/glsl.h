// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as GLSL ES 3.00, the language of WebGL 2, in single precision.
//
// A real is a float, a colour a vec3, a truth value a bool. What GLSL lacks, or computes with few digits on some
// devices, is a function of the hand-written library explorer/library.glsl.
#pragma once

#include <string>
#include <vector>

#include "print/program_printer.h"

namespace brdfc::print {

struct GlslArgument {
  std::string name;
  ExprType type;
};

/// True if variables can't have the name: for a keyword, a built-in function, and what the library defines.
bool is_glsl_word(const std::string& name);

/// The source of a function with these arguments whose outputs have the types in `results`, where a real may become a
/// grey colour. A single output is returned; several are `out` arguments after the others, with their own names. Its
/// tables are samplers, table_NAME, and are added to `tables`. Arguments whose name is a word of GLSL have a `_`
/// appended. Throws ExprError for operations that GLSL does not have, and if two tables have the same name.
std::string glsl_function(const Program&, const std::string& name, const std::vector<GlslArgument>& arguments,
                          const std::vector<ExprType>& results, Tables& tables);

}  // namespace brdfc::print
