// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/optical_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "core/csv.h"
#include "core/error.h"
#include "core/parse.h"
#include "core/text_file.h"
#include "model/optical.h"
#include "model/yaml_styles.h"

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
  if (1000 * range[0] > kNeededMin || 1000 * range[1] < kNeededMax)
    input_error("{}: expected a formula for {:g} to {:g} \xc2\xb5m, got one for {:g} to {:g} \xc2\xb5m", where,
                kNeededMin / 1000, kNeededMax / 1000, range[0], range[1]);
  const double low = std::max(1000 * range[0], kSeenMin), high = std::min(1000 * range[1], kSeenMax);
  std::vector<double> nm;
  for (double x = low; x < high; x += kStep) nm.push_back(x);
  nm.push_back(high);
  for (const double x : nm) out.n.push_back({x / 1000, of_formula(formula, c, x / 1000), entry.line});
}

/// The list under DATA, and the text under REFERENCES.
class Database {
 public:
  Database(const std::vector<std::string>& lines, const std::string& file) : file_(file) {
    int number = 0;
    for (const std::string& full : lines) {
      ++number;
      if (give_) {
        open_ += "\n" + full;
        unclosed_ += unclosed(full);
        // Reading a long table anew at each line would take long.
        if (may_end(open_, full, unclosed_)) styled(std::string(open_), give_, since_);
      } else {
        read(full, number);
      }
    }
    if (give_) fail(since_, open_);
  }

  std::vector<Entry> entries;
  std::string source;

 private:
  using Give = void (Database::*)(const YamlValue&, int);

  [[noreturn]] void fail(int line, const std::string& text,
                         const std::string& expected = "a string, a list or a mapping of YAML") const {
    input_error("{} line {}: expected {}, got '{}'", file_, line, expected, trim(text.substr(0, text.find('\n'))));
  }

  static bool is_block(const std::string& text) { return text == "|" || text == "|-" || text == ">"; }

  static YamlValue text_of(const std::string& text) {
    YamlValue out;
    out.text = text;
    return out;
  }

  void read(const std::string& full, int number) {
    std::string line = trim(full);
    if (line.empty() || line[0] == '#') return;
    const auto [key, rest] = key_and_rest(full);
    if (!key.empty()) {
      section_ = key, key_.clear(), line = trim(rest);
      if (key == "REFERENCES" && is_styled(line)) return styled(line, &Database::refer, number);
      if (is_block(line) || line.starts_with("#")) line.clear();
    }
    if (section_ == "REFERENCES" && !line.empty())
      refer(text_of(line), number);
    else if (section_ == "DATA" && !line.empty())
      entry(line, number);
  }

  void refer(const YamlValue& found, int) {
    if (!source.empty()) source += ' ';
    source += trim(without_tags(found.text));
  }

  /// A line under DATA.
  void entry(std::string line, int number) {
    if (line[0] == '[') return styled(line, &Database::add_all, number);
    if (line.starts_with("- ")) {
      entries.push_back({"", number, {}});
      line = trim(line.substr(2));
    }
    if (entries.empty()) fail(number, line, "'- type: ...'");
    if (line.starts_with("{")) return styled(line, &Database::add_keys, number);
    if (const auto [key, rest] = key_and_rest(line); !key.empty()) {
      key_ = key, line = trim(rest);
      if (is_styled(line)) return styled(line, &Database::add, number);
      if (is_block(line)) return;
    }
    add(text_of(line), number);
  }

  /// Gives the value that a text is to a function, perhaps after further lines.
  void styled(const std::string& text, Give give, int number) {
    std::optional<YamlValue> value;
    try {
      value = yaml_value(text);
    } catch (const std::invalid_argument&) {
      fail(number, text);
    }
    open_ = value ? "" : text, unclosed_ = unclosed(open_), give_ = value ? nullptr : give, since_ = number;
    if (value) (this->*give)(*value, number);
  }

  void add_all(const YamlValue& found, int number) {
    for (const YamlValue& keys : found.list) {
      entries.push_back({"", number, {}});
      add_keys(keys, number);
    }
  }

  void add_keys(const YamlValue& keys, int number) {
    if (keys.kind != YamlValue::Kind::Mapping) fail(number, keys.text, "'- type: ...'");
    for (std::size_t i = 0; i < keys.keys.size(); ++i) {
      key_ = keys.keys[i];
      add(keys.list[i], number);
    }
  }

  static std::string joined(const YamlValue& row) {
    std::string out = row.text;
    for (const YamlValue& field : row.list) out += (out.empty() ? "" : " ") + field.text;
    return out;
  }

  /// Adds lines to the value of the present key.
  void add(const YamlValue& value, int number) {
    if (value.kind == YamlValue::Kind::Mapping) fail(number, key_, "numbers");
    std::string text = joined(value);
    if (!value.list.empty() && value.list[0].kind == YamlValue::Kind::List) {
      text.clear();
      for (const YamlValue& row : value.list) text += joined(row) + "\n";
    }
    if (key_ == "type") {
      entries.back().type = trim(text), entries.back().line = number;
      return;
    }
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
      if (!trim(line).empty()) entries.back().found[key_].push_back({words_of(line), trim(line), number});
  }

  const std::string& file_;
  std::string section_, key_, open_;
  Give give_ = nullptr;
  int since_ = 0, unclosed_ = 0;
};

OpticalFile read_database(const std::vector<std::string>& lines, const std::string& file) {
  OpticalFile out;
  const Database database(lines, file);
  out.source = database.source;
  for (const Entry& entry : database.entries) {
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

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

bool is_yaml(const std::string& name) {
  const std::string plain = lower(name);
  return plain.ends_with(".yml") || plain.ends_with(".yaml");
}

}  // namespace

bool is_optical_file(std::string name) {
  name = lower(name);
  return name.ends_with(".csv") || name.ends_with(".txt") || is_yaml(name);
}

OpticalFile read_optical_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  const std::vector<std::string> lines = read_lines(path);
  const bool is_database =
      std::ranges::any_of(lines, [](const std::string& line) { return key_and_rest(line).first == "DATA"; });
  if (!is_database && is_yaml(file))
    input_error("{}: expected a file of refractiveindex.info's database (YAML), with a list DATA, found none", file);
  OpticalFile out = is_database ? read_database(lines, file) : read_export(lines, file);
  if (out.n.empty() && is_database) input_error("{}: expected n under DATA, found none", file);
  if (out.n.empty()) input_error("{}: expected a line wl,n and rows below it, found no n", file);
  return out;
}

}  // namespace brdfc::inline model
