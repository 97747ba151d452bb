// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as Python on arrays, of NumPy or of a library like it.
//
// A real is an array of shape (N,), a colour (3, N). Constants are (), (1,) or (3, 1), which broadcast.
#pragma once

#include <string>
#include <vector>

#include "print/program_printer.h"

namespace brdfc::print {

/// True if Python functions use the name themselves: for a keyword, a module or function that formulas call, or a
/// table.
bool is_python_word(const std::string& name);

/// The source of a function with these arguments that returns the outputs in order; a single output is returned without
/// a tuple. Its first argument, np, has what it calls: NumPy's functions by their names, np.rgb(r, g, b) and
/// np.lookup(table, coordinates...). It refers to its tables as table_NAME, which are added to `tables`. Throws
/// ExprError for an argument that is no valid name in Python, and if two tables have the same name.
std::string numpy_function(const Program&, const std::string& name, const std::vector<std::string>& arguments,
                           Tables& tables);

/// The statement that creates table_NAME with a call of table(sizes, text).
std::string numpy_table(const Table&);

/// The shortest text that reads back as the same double. Throws ExprError unless the number is finite.
std::string python_number(double);

/// A string literal in double quotes.
std::string python_string(const std::string&);

/// Text in triple double quotes, wrapped at spaces to at most 100 characters per line. All lines but the first are
/// indented by `indent`.
std::string python_docstring(const std::vector<std::string>& paragraphs, int indent);

}  // namespace brdfc::print
