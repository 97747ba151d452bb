// SPDX-License-Identifier: GPL-3.0-or-later
// Helpers for OSL source text.
#pragma once

#include <array>
#include <string>
#include <vector>

namespace brdfc::print {

/// The text of statements, and the number of those that end in a semicolon.
struct OslText {
  std::string text;
  int statements = 0;
};

/// The shortest text that reads back as the same float. Throws ExprError for a number that no float represents.
std::string number(double);
std::string color(const std::array<double, 3>&);

/// A string literal.
std::string quoted(const std::string&);

/// Comment lines, wrapped between words.
std::string comment(const std::string&);

/// Indents every line that is not empty by `levels` more levels.
std::string indented(const std::string& text, std::size_t levels = 1);

/// Halves the indentation of every line: a .blend stores the text of each shader, and there are many deeply nested
/// blocks.
std::string narrow(const std::string& text);

/// The declaration of an array.
std::string array(const std::string& name, const std::vector<double>& values);

}  // namespace brdfc::print
