// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/optical_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <sstream>

#include "core/csv.h"
#include "core/error.h"
#include "core/parse.h"
#include "core/text_file.h"
#include "model/optical.h"

namespace brdfc::inline model {
namespace {

/// Distance in nm of the wavelengths at which a formula is tabulated: that of the observer's tables.
constexpr double kStep = 5;

std::vector<double> numbers_of(const std::vector<std::string>& fields) {
  std::vector<double> out;
  for (const std::string& f : fields)
    if (const auto value = parse(f); value && std::isfinite(*value)) out.push_back(*value);
  return out;
}

/// Adds a row of a table with these columns beside the wavelength.
void add_row(OpticalFile& out, const std::string& columns, const std::vector<std::string>& fields,
             const std::string& text, const std::string& where, int line) {
  const std::vector<double> row = numbers_of(fields);
  if (row.size() != fields.size() || row.size() != columns.size() + 1)
    input_error("{}: expected {} numbers, a wavelength in \xc2\xb5m and {}, got '{}'", where, columns.size() + 1,
                columns == "nk" ? "n and k" : columns, text);
  for (std::size_t i = 0; i < columns.size(); ++i)
    (columns[i] == 'n' ? out.n : out.k).push_back({row[0], row[i + 1], line});
}

void check_once(const OpticalFile& found, char letter, const std::string& where) {
  if (!(letter == 'n' ? found.n : found.k).empty()) input_error("{}: expected {} once", where, letter);
}

// ---- Exports ---------------------------------------------------------------------------------------------

/// A line of the two kinds that refractiveindex.info exports: fields are separated by commas or by tabs.
std::string with_commas(std::string line) {
  if (line.find(',') == std::string::npos) std::ranges::replace(line, '\t', ',');
  return line;
}

OpticalFile read_export(const std::vector<std::string>& lines, const std::string& file) {
  OpticalFile out;
  std::string block;  // the columns beside wl
  int number = 0, comments = 0;
  for (const std::string& text : lines) {
    const std::string line = trim(text), where = fmt::format("{} line {}", file, ++number);
    if (line.empty()) continue;
    if (line[0] == '#') {
      ++comments;
      if (comments == 1) out.label = trim(line.substr(1));
      if (comments == 2) out.source = trim(line.substr(1));
      continue;
    }
    const std::vector<std::string> header = split_header(with_commas(line));
    const bool is_header = header[0] == "wl";
    if (is_header) {
      block.clear();
      for (std::size_t i = 1; i < header.size(); ++i) {
        if (header[i] != "n" && header[i] != "k") break;
        const char letter = header[i][0];
        check_once(out, letter, where);
        if (block.find(letter) != std::string::npos) input_error("{}: expected {} once", where, letter);
        block.push_back(letter);
      }
      if (block.empty() || block.size() + 1 != header.size()) block.clear();
    }
    if (block.empty()) input_error("{}: expected the header wl,n or wl,k or wl,n,k, got '{}'", where, line);
    if (!is_header) add_row(out, block, split_fields(with_commas(line)), line, where, number);
  }
  return out;
}

// ---- Files of the database -------------------------------------------------------------------------------

/// An entry of the list DATA: its keys with the words that follow them, line by line.
struct Words {
  std::vector<std::string> words;
  std::string text;
  int line;
};
struct Entry {
  std::string type;
  int line = 0;
  std::map<std::string, std::vector<Words>> found;

  std::vector<std::string> all(const std::string& key) const {
    std::vector<std::string> out;
    if (const auto at = found.find(key); at != found.end())
      for (const Words& w : at->second) out.insert(out.end(), w.words.begin(), w.words.end());
    return out;
  }
};

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> out;
  for (std::string word; in >> word;) out.push_back(word);
  return out;
}

/// True for a line "KEY:" or "KEY: value" without indent.
bool is_section(const std::string& line) {
  return !line.empty() && std::isalpha(static_cast<unsigned char>(line[0])) && line.find(':') != std::string::npos;
}

/// A text without the tags of HTML.
std::string without_tags(const std::string& text) {
  std::string out;
  bool inside = false;
  for (const char c : text) {
    inside = inside || c == '<';
    if (!inside) out += c;
    inside = inside && c != '>';
  }
  return out;
}

/// n by the formula of this number at a wavelength in um. Its coefficients are a constant and pairs.
double of_formula(int formula, const std::vector<double>& c, double um) {
  const double square = um * um;
  double sum = c[0];
  for (std::size_t i = 1; i + 1 < c.size(); i += 2) {
    if (formula == 1) sum += c[i] * square / (square - c[i + 1] * c[i + 1]);
    if (formula == 2) sum += c[i] * square / (square - c[i + 1]);
    if (formula == 3 || formula == 5) sum += c[i] * std::pow(um, c[i + 1]);
    if (formula == 6) sum += c[i] / (c[i + 1] - 1 / square);
  }
  return formula < 3 ? std::sqrt(1 + sum) : formula == 3 ? std::sqrt(sum) : formula == 5 ? sum : 1 + sum;
}

void add_formula(OpticalFile& out, int formula, const Entry& entry, const std::string& where) {
  const std::vector<std::string> words = entry.all("coefficients");
  std::vector<std::string> ends = entry.all("wavelength_range");
  if (ends.empty()) ends = entry.all("range");
  const std::vector<double> c = numbers_of(words), range = numbers_of(ends);
  if (c.size() != words.size() || c.size() % 2 == 0)
    input_error("{}: expected coefficients of formula {}, a number and pairs of numbers", where, formula);
  if (range.size() != 2 || ends.size() != 2 || !(range[0] < range[1]))
    input_error("{}: expected a wavelength_range of two numbers in \xc2\xb5m", where);
  const double low = std::max(1000 * range[0], kSeenMin), high = std::min(1000 * range[1], kSeenMax);
  std::vector<double> nm;
  for (double x = low; x < high; x += kStep) nm.push_back(x);
  nm.push_back(high);
  for (const double x : nm) out.n.push_back({x / 1000, of_formula(formula, c, x / 1000), entry.line});
}

OpticalFile read_database(const std::vector<std::string>& lines, const std::string& file) {
  OpticalFile out;
  std::vector<Entry> entries;
  std::string section, key;
  int number = 0;
  for (const std::string& full : lines) {
    ++number;
    std::string line = trim(full);
    if (line.empty() || line[0] == '#') continue;
    if (is_section(full)) {
      section = full.substr(0, full.find(':'));
      line = trim(line.substr(section.size() + 1));
      if (line == "|" || line == "|-" || line == ">") line.clear();
      key.clear();
    }
    if (section == "REFERENCES" && !line.empty()) {
      if (!out.source.empty()) out.source += ' ';
      out.source += without_tags(line);
    }
    if (section != "DATA" || line.empty()) continue;
    if (line.starts_with("- ")) {
      entries.push_back({"", number, {}});
      line = trim(line.substr(2));
    }
    if (entries.empty()) input_error("{} line {}: expected '- type: ...', got '{}'", file, number, line);
    Entry& entry = entries.back();
    if (const auto colon = line.find(':'); colon != std::string::npos) {
      key = line.substr(0, colon);
      line = trim(line.substr(colon + 1));
      std::erase(line, '"');
      if (key == "type") entry.type = line, entry.line = number;
      if (line == "|" || line == "|-" || line == ">") continue;
    }
    entry.found[key].push_back({words_of(line), line, number});
  }
  for (const Entry& entry : entries) {
    const std::string where = fmt::format("{} line {}", file, entry.line);
    const std::vector<std::string> type = words_of(entry.type);
    const bool is_table = type.size() == 2 && type[0] == "tabulated";
    if (is_table && (type[1] == "n" || type[1] == "k" || type[1] == "nk")) {
      for (const char letter : type[1]) check_once(out, letter, where);
      if (const auto rows = entry.found.find("data"); rows != entry.found.end())
        for (const Words& row : rows->second)
          add_row(out, type[1], row.words, row.text, fmt::format("{} line {}", file, row.line), row.line);
    } else if (type.size() == 2 && type[0] == "formula" && type[1].size() == 1 &&
               std::string("12356").find(type[1]) != std::string::npos) {
      check_once(out, 'n', where);
      add_formula(out, type[1][0] - '0', entry, where);
    } else {
      input_error(
          "{}: expected tabulated n, k or nk, or formula 1, 2, 3, 5 or 6, got '{}'; the page of the substance on "
          "refractiveindex.info has its table under Data > CSV",
          where, entry.type);
    }
  }
  return out;
}

}  // namespace

bool is_optical_file(std::string name) {
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return name.ends_with(".csv") || name.ends_with(".txt") || name.ends_with(".yml") || name.ends_with(".yaml");
}

OpticalFile read_optical_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  const std::vector<std::string> lines = read_lines(path);
  const bool is_database = std::ranges::any_of(
      lines, [](const std::string& line) { return line.starts_with("DATA:") && trim(line) == "DATA:"; });
  OpticalFile out = is_database ? read_database(lines, file) : read_export(lines, file);
  if (out.n.empty() && is_database) input_error("{}: expected n under DATA, found none", file);
  if (out.n.empty()) input_error("{}: expected a line wl,n and rows below it, found no n", file);
  return out;
}

}  // namespace brdfc::inline model
