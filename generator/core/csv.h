// SPDX-License-Identifier: GPL-3.0-or-later
// Reads and writes CSV files with a header line.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "core/vec.h"

namespace brdfc::inline core {

/// The text without leading and trailing spaces, tabs and carriage returns.
std::string trim(const std::string&);
/// The fields of a line, which commas separate, each trimmed. Quotes around a field are left out; a comma between
/// quotes is part of the field.
std::vector<std::string> split_fields(const std::string& line);
/// The same of a table's first line, for names that may have capitals, and without the mark with which some programs
/// begin a file in UTF-8.
std::vector<std::string> split_header(const std::string& line);

/// The text after the sign # if a line begins with it, otherwise nothing.
std::optional<std::string> comment_of(const std::string& line);

/// Reads numbers from named columns. The columns may come in any order, and other columns are ignored, so that the
/// output of one command can be the input of the next. Capitals in their names do not matter. Lines that begin with #
/// are comments; before the first other line, one that has the name of a column is the header, as programs write it
/// that read tables without one. Every error is an InputError that names line, column and what was expected. Numbers
/// must be finite.
class CsvReader {
 public:
  /// Reads the header. For an input without any line empty() is true; only the caller can tell whether that is an
  /// error.
  CsvReader(std::istream&, std::string source, std::vector<std::string> columns);
  bool empty() const { return line_ == 0; }
  /// The names of other columns, which are ignored.
  const std::vector<std::string>& others() const { return others_; }
  /// Reads the next line's numbers, in the order of `columns`. Returns false at the end. Blank lines and comments are
  /// skipped.
  bool next(std::vector<double>& row);
  /// The place of the row read last, for messages: "stdin line 7".
  std::string where() const;
  int line() const { return line_; }
  /// The unit vector in three columns starting at `first`. Throws unless its length is 1 within 1e-6; the result is
  /// normalised in double precision.
  Vec3<double> unit_vector(const std::vector<double>& row, std::size_t first) const;

 private:
  bool read_line(std::string& line);

  std::istream& in_;
  std::string source_;
  std::vector<std::string> columns_, others_;
  std::vector<std::size_t> where_;  // index of each column's field in a line
  std::size_t fields_ = 0;
  int line_ = 0;
};

/// Collects output and writes it to stdout in large pieces. Throws InputError if stdout can't be written.
class CsvWriter {
 public:
  explicit CsvWriter(const std::string& header) { text_ = header + "\n"; }
  /// Adds a row of numbers with 17 significant digits.
  void row(const std::vector<double>& values);
  /// Writes the rows so far; to be called at the end, and after each row of a table whose rows take long.
  void flush();

 private:
  void write();
  std::string text_;
};

}  // namespace brdfc::inline core
