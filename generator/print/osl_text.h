// SPDX-License-Identifier: GPL-3.0-or-later
// Pieces of OSL text.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace brdfc::print {

/// Text of statements, and how many of them end in a semicolon.
struct OslText {
  std::string text;
  int statements = 0;
};

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

/// The declaration of an array.
std::string array(const std::string& name, const std::vector<double>& values);

}  // namespace brdfc::print
