// SPDX-License-Identifier: GPL-3.0-or-later
// Pieces of OSL text.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace brdfc::print {

/// Of a float, with as few digits as tell it from all others. Throws ExprError for what no float is.
std::string number(double);
std::string color(const std::array<double, 3>&);

/// A string literal.
std::string quoted(const std::string&);

/// Lines of comment, broken between words.
std::string comment(const std::string&);

/// Every line of the text but empty ones, `levels` steps further in.
std::string indented(const std::string& text, std::size_t levels = 1);

/// Every line with half its indent: a .blend keeps the text of each shader, and deep blocks are many.
std::string narrow(const std::string& text);

/// In a scope of their own, so that what they declare stands in no other's way. None where there is nothing to do.
std::string block(const std::string& statements, std::size_t levels);

/// The declaration of an array.
std::string array(const std::string& name, const std::vector<double>& values);

/// a + b + ... as a balanced tree: Cycles walks a sum with a stack of 16, so that a chain loses terms.
std::string balanced_sum(const std::vector<std::string>& terms);

}  // namespace brdfc::print
