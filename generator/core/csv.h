// SPDX-License-Identifier: GPL-3.0-or-later
// CSV with a header, in and out.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <istream>
#include <string>
#include <vector>

#include "core/vec.h"

namespace brdfc::inline core {

/// Without spaces, tabs and carriage returns at both ends.
std::string trim(const std::string&);
/// What stands between commas, trimmed.
std::vector<std::string> split_fields(const std::string& line);

/// Numbers in named columns. Columns may come in any order; others than those asked for are ignored, so that the
/// output of one command can be the input of the next. Every error is an InputError naming line, column and what
/// was expected. Numbers must be finite.
class CsvReader {
 public:
  /// Reads the header. An input without any line is empty(), which only the caller can judge.
  CsvReader(std::istream&, std::string source, std::vector<std::string> columns);
  bool empty() const { return line_ == 0; }
  /// The next line's numbers in the order asked for; false at the end. Blank lines are skipped.
  bool next(std::vector<double>& row);
  /// "stdin line 7", for messages about the row read last.
  std::string where() const;
  /// The unit vector in three columns starting at `first`. Throws unless its length is 1 within 1e-6;
  /// then it is normalised in double precision.
  Vec3<double> unit_vector(const std::vector<double>& row, std::size_t first) const;

 private:
  bool read_line(std::vector<std::string>& fields);

  std::istream& in_;
  std::string source_;
  std::vector<std::string> columns_;
  std::vector<std::size_t> where_;  // field of each column
  std::size_t fields_ = 0;
  int line_ = 0;
};

/// Gathers output and writes it to stdout in large pieces; throws InputError if stdout can't take it.
class CsvWriter {
 public:
  explicit CsvWriter(const std::string& header) { text_ = header + "\n"; }
  /// Numbers with 17 significant digits.
  void row(const std::vector<double>& values);
  /// Call at the end: writes what is left.
  void finish();

 private:
  void write();
  std::string text_;
};

}  // namespace brdfc::inline core
