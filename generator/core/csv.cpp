// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/csv.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/parse.h"
#include "core/text.h"

namespace brdfc::inline core {

std::string trim(const std::string& s) {
  const auto first = s.find_first_not_of(" \t\r"), last = s.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : s.substr(first, last - first + 1);
}

std::vector<std::string> split_fields(const std::string& line) {
  std::vector<std::string> fields;
  std::size_t at = 0;
  for (;;) {
    const auto first = line.find_first_not_of(" \t\r", at);
    std::string field;
    if (first != std::string::npos && line[first] == '"') {
      // A quote is written twice between quotes.
      for (at = first + 1; at < line.size(); ++at) {
        if (line[at] == '"' && (++at == line.size() || line[at] != '"')) break;
        field += line[at];
      }
    }
    const auto comma = line.find(',', at);
    field += line.substr(std::min(at, line.size()), comma == std::string::npos ? comma : comma - at);
    fields.push_back(trim(field));
    if (comma == std::string::npos) return fields;
    at = comma + 1;
  }
}

std::vector<std::string> split_header(const std::string& line) {
  auto fields = split_fields(line.starts_with("\xEF\xBB\xBF") ? line.substr(3) : line);
  for (std::string& f : fields)
    for (char& c : f)
      if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return fields;
}

std::optional<std::string> comment_of(const std::string& line) {
  const std::string text = trim(line.starts_with("\xEF\xBB\xBF") ? line.substr(3) : line);
  if (!text.starts_with('#')) return std::nullopt;
  return text.substr(std::min(text.find_first_not_of('#'), text.size()));
}

CsvReader::CsvReader(std::istream& in, std::string source, std::vector<std::string> columns)
    : in_(in), source_(std::move(source)), columns_(std::move(columns)) {
  std::string line;
  std::vector<std::string> header;
  const auto is_header = [&] {
    const std::optional<std::string> comment = comment_of(line);
    header = split_header(comment.value_or(line));
    return !comment || std::ranges::any_of(columns_, [&](const std::string& c) {
      return std::find(header.begin(), header.end(), c) != header.end();
    });
  };
  do {
    if (!read_line(line)) {
      line_ = 0;
      return;
    }
  } while (!is_header());
  fields_ = header.size();
  const auto separated_by = [&](char c) { return fields_ == 1 && header[0].find(c) != std::string::npos; };
  for (const auto& [separator, title] : {std::pair(';', "semicolons"), std::pair('\t', "tabs")})
    if (columns_.size() > 1 && separated_by(separator))
      input_error("{}: expected fields separated by commas, got {}: '{:.80}'", where(), title, header[0]);
  for (const std::string& c : columns_) {
    const auto found = std::find(header.begin(), header.end(), c);
    if (found == header.end())
      input_error("{}: expected a header with the columns {}; '{}' is missing, got '{:.80}'", where(),
                  join(columns_, ","), c, join(header, ","));
    if (std::find(found + 1, header.end(), c) != header.end())
      input_error("{}: expected one column {}, found several", where(), c);
    where_.push_back(std::size_t(found - header.begin()));
  }
  for (const std::string& name : header)
    if (std::find(columns_.begin(), columns_.end(), name) == columns_.end()) others_.push_back(name);
}

std::string CsvReader::where() const { return fmt::format("{} line {}", source_, line_); }

bool CsvReader::read_line(std::string& line) {
  while (std::getline(in_, line)) {
    ++line_;
    if (!trim(line).empty()) return true;
  }
  return false;
}

bool CsvReader::next(std::vector<double>& row) {
  std::string line;
  do {
    if (!read_line(line)) return false;
  } while (comment_of(line));
  const std::vector<std::string> fields = split_fields(line);
  if (fields.size() != fields_)
    input_error("{}: expected {} values as in the header, got {}", where(), fields_, fields.size());
  row.clear();
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const std::string& text = fields[where_[i]];
    const auto value = parse(text);
    if (!value || !std::isfinite(*value))
      input_error("{}: {}: expected a finite number, got '{}'", where(), columns_[i], text);
    row.push_back(*value);
  }
  return true;
}

Vec3<double> CsvReader::unit_vector(const std::vector<double>& row, std::size_t first) const {
  const Vec3<double> v{row[first], row[first + 1], row[first + 2]};
  const double len = length(v);
  if (!(std::abs(len - 1) <= 1e-6))
    input_error("{}: {}, {}, {}: expected a unit vector, its length is {}", where(), columns_[first],
                columns_[first + 1], columns_[first + 2], len);
  return v / len;
}

void CsvWriter::row(const std::vector<double>& values) {
  const char* separator = "";
  for (const double v : values) {
    fmt::format_to(std::back_inserter(text_), "{}{:.17g}", separator, v);
    separator = ",";
  }
  text_ += '\n';
  if (text_.size() > (1u << 16)) write();
}

void CsvWriter::write() {
  if (std::fwrite(text_.data(), 1, text_.size(), stdout) != text_.size())
    input_error("stdout: expected to write {} bytes, could not", text_.size());
  text_.clear();
}

void CsvWriter::flush() {
  write();
  if (std::fflush(stdout) != 0) input_error("stdout: expected to write the table, could not");
}

}  // namespace brdfc::inline core
