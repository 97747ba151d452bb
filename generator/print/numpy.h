// SPDX-License-Identifier: GPL-3.0-or-later
// A recorded program as Python on NumPy arrays, in double precision.
//
// A real is an array (N,), a colour (3, N), what is constant (), (1,) or (3, 1): shapes that NumPy broadcasts by
// itself.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "trace/program.h"

namespace brdfc::print {

/// Tables by name, which the functions of a module read.
using NumpyTables = std::map<std::string, std::shared_ptr<const Table>>;

/// Whether a function of Python uses that name itself: a keyword, a module or a function that formulas call, a table.
bool is_python_word(const std::string& name);

/// Text of a function of these arguments that returns the outputs in their order, a single one by itself. It calls np,
/// rgb(r, g, b) and lookup(table, coordinates...), and names its tables table_NAME, which are added to `tables`.
/// Throws ExprError for an argument that Python can't have, and if two tables have one name.
std::string numpy_function(const Program&, const std::string& name, const std::vector<std::string>& arguments,
                           NumpyTables& tables);

/// The statement that makes table_NAME, of table(sizes, text).
std::string numpy_table(const Table&);

/// A double with as few digits as tell it from all others. Throws ExprError unless it is finite.
std::string python_number(double);

/// A string literal in double quotes.
std::string python_string(const std::string&);

/// Text between three double quotes, in lines of at most 100 characters where there are spaces to break at; `indent`
/// goes before all lines but the first.
std::string python_docstring(const std::vector<std::string>& paragraphs, int indent);

}  // namespace brdfc::print
