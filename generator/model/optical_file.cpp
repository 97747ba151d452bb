// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/optical_file.h"

#include <algorithm>
#include <array>
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
             const std::string& text, const std::string& where, int line, double unit = 1) {
  const std::vector<double> row = numbers_of(fields);
  if (row.size() != fields.size() || row.size() != columns.size() + 1)
    input_error("{}: expected {} numbers, a wavelength and {}, got '{}'", where, columns.size() + 1,
                columns == "nk" ? "n and k" : columns, text);
  for (std::size_t i = 0; i < columns.size(); ++i)
    (columns[i] == 'n' ? out.n : out.k).push_back({row[0] * unit, row[i + 1], line});
}

void check_once(const OpticalFile& found, char letter, const std::string& where) {
  if (!(letter == 'n' ? found.n : found.k).empty()) input_error("{}: expected {} once", where, letter);
}

// ---- Tables with a header, such as exports ---------------------------------------------------------------

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

/// What a header says of its first column: nothing if these are not wavelengths; otherwise their unit in um, or 0 if
/// the header does not state it. Such as "wl", "nm", "Wavelength (nm)", "lambda [um]", "wavelength_nm".
std::optional<double> wavelength_unit(const std::string& field) {
  static const std::map<std::string, double> units = {{"", 0},
                                                      {"nm", 1e-3},
                                                      {"nanometer", 1e-3},
                                                      {"nanometers", 1e-3},
                                                      {"nanometre", 1e-3},
                                                      {"um", 1},
                                                      {"\xc2\xb5m", 1},
                                                      {"\xce\xbcm", 1},
                                                      {"micron", 1},
                                                      {"microns", 1},
                                                      {"micrometer", 1},
                                                      {"micrometers", 1},
                                                      {"micrometre", 1},
                                                      {"a", 1e-4},
                                                      {"angstrom", 1e-4},
                                                      {"angstroms", 1e-4},
                                                      {"\xc3\x85", 1e-4},
                                                      {"\xc3\xa5", 1e-4},
                                                      {"\xe2\x84\xab", 1e-4}};
  const std::string around = " _/()[]";
  for (const std::string name : {"wavelengths", "wavelength", "wl", "lambda", "\xce\xbb", ""}) {
    if (!field.starts_with(name)) continue;
    const std::string rest = field.substr(name.size());
    const auto first = rest.find_first_not_of(around);
    const std::string unit =
        first == std::string::npos ? "" : rest.substr(first, rest.find_last_not_of(around) + 1 - first);
    if (name.empty() ? unit.size() > 1 : first != 0)
      if (const auto at = units.find(unit); at != units.end()) return at->second;
  }
  return std::nullopt;
}

/// 'n' or 'k' for the name of its column, otherwise 0.
char letter_of(const std::string& field) {
  if (field == "n" || field == "index" || field == "refractive index" || field == "index of refraction") return 'n';
  if (field == "k" || field == "kappa" || field == "extinction coefficient") return 'k';
  return 0;
}

/// A line whose fields are separated by commas, by tabs or by semicolons.
std::string with_commas(std::string line, char separator) {
  if (line.find(',') == std::string::npos) std::ranges::replace(line, separator, ',');
  return line;
}

OpticalFile read_table(const std::vector<std::string>& lines, const std::string& file) {
  OpticalFile out;
  std::string block;  // the columns beside the wavelength
  double unit = 0;
  char separator = '\t';
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
    const char here = line.find('\t') == std::string::npos && line.find(';') != std::string::npos ? ';' : '\t';
    const std::vector<std::string> header = split_header(with_commas(line, here));
    const auto stated = wavelength_unit(header[0]);
    if (stated) {
      block.clear();
      for (std::size_t i = 1; i < header.size(); ++i) {
        const char letter = letter_of(header[i]);
        if (!letter) break;
        check_once(out, letter, where);
        if (block.find(letter) != std::string::npos) input_error("{}: expected {} once", where, letter);
        block.push_back(letter);
      }
      if (block.empty() || block.size() + 1 != header.size()) block.clear();
      if (out.n.size() + out.k.size() && out.in_um != (*stated > 0))
        input_error("{}: expected the unit of wavelengths in each header or in none, got '{}'", where, line);
      unit = *stated, separator = here, out.in_um = unit > 0;
    }
    if (block.empty()) input_error("{}: expected the header wl,n or wl,k or wl,n,k, got '{}'", where, line);
    if (!stated)
      add_row(out, block, split_fields(with_commas(line, separator)), line, where, number, unit > 0 ? unit : 1);
  }
  return out;
}

// ---- Spectra ---------------------------------------------------------------------------------------------

/// Adds a spectrum: pairs of a wavelength in nm and a value, separated by spaces, in lines of any length.
void add_spectrum(std::vector<OpticalRow>& rows, const std::filesystem::path& path) {
  int number = 0;
  std::optional<double> nm;
  for (const std::string& line : read_lines(path)) {
    ++number;
    std::istringstream in(line.substr(0, line.find('#')));
    for (std::string word; in >> word;) {
      const auto value = parse(word);
      if (!value || !std::isfinite(*value))
        input_error("{} line {}: expected pairs of a wavelength in nm and a value, got '{}'", path.string(), number,
                    word);
      if (nm) rows.push_back({*nm / 1000, *value, number});
      nm = nm ? std::nullopt : value;
    }
  }
  if (nm) input_error("{}: expected pairs of a wavelength in nm and a value, got an odd count", path.string());
}

/// The spectra of n and of k, by the end of their names; only that of n must exist.
OpticalFile read_spectra(const std::filesystem::path& path) {
  const std::string stem = path.stem().string(), plain = lower(stem);
  for (const std::string separator : {".", "-", "_"})
    for (const std::string end : {"eta", "k"})
      if (plain.ends_with(separator + end)) {
        OpticalFile out;
        out.label = stem.substr(0, stem.size() - end.size() - 1);
        out.in_um = true;
        const auto file_of = [&](const std::string& which) {
          return path.parent_path() / (out.label + separator + which + path.extension().string());
        };
        add_spectrum(out.n, end == "eta" ? path : file_of("eta"));
        const std::filesystem::path k = end == "k" ? path : file_of("k");
        if (std::filesystem::exists(k)) add_spectrum(out.k, k);
        return out;
      }
  input_error("{}: expected the name NAME.eta.spd, for the spectrum of n, with that of k in NAME.k.spd", path.string());
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

/// The fewest coefficients of each formula, and the most of 4, 7, 8 and 9, which are not sums of equal terms.
constexpr std::array<std::size_t, 10> kFewest = {0, 1, 1, 1, 9, 1, 1, 3, 4, 6}, kMost = {0, 0, 0, 0, 17, 0, 0, 6, 4, 6};

/// n by the formula of this number at a wavelength in um: those of refractiveindex.info's database, "Dispersion
/// formulas". Sums have a constant and pairs of coefficients.
double of_formula(int formula, const std::vector<double>& c, double um) {
  const double square = um * um;
  if (formula == 4) {
    double n2 = c[0];
    for (std::size_t i = 1; i < 9; i += 4)
      n2 += c[i] * std::pow(um, c[i + 1]) / (square - std::pow(c[i + 2], c[i + 3]));
    for (std::size_t i = 9; i + 1 < c.size(); i += 2) n2 += c[i] * std::pow(um, c[i + 1]);
    return std::sqrt(n2);
  }
  if (formula == 7) {  // Herzberger
    const double l = 1 / (square - 0.028);
    double n = c[0] + c[1] * l + c[2] * l * l, power = square;
    for (std::size_t i = 3; i < c.size(); ++i, power *= square) n += c[i] * power;
    return n;
  }
  if (formula == 8) {  // Clausius-Mossotti: a = (n^2 - 1) / (n^2 + 2)
    const double a = c[0] + c[1] * square / (square - c[2]) + c[3] * square;
    return std::sqrt((1 + 2 * a) / (1 - a));
  }
  if (formula == 9) {
    const double apart = um - c[4];
    return std::sqrt(c[0] + c[1] / (square - c[2]) + c[3] * apart / (apart * apart + c[5]));
  }
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
  const std::size_t fewest = kFewest[std::size_t(formula)], most = kMost[std::size_t(formula)];
  if (c.size() != words.size() || c.size() < fewest || (most && c.size() > most) ||
      ((!most || formula == 4) && c.size() % 2 == 0))
    input_error("{}: expected coefficients of formula {}, {}", where, formula,
                !most            ? "a number and pairs of numbers"
                : formula == 4   ? "9 numbers and up to 4 pairs of numbers"
                : fewest == most ? fmt::format("{} numbers", most)
                                 : fmt::format("{} to {} numbers", fewest, most));
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
               std::string("123456789").find(type[1]) != std::string::npos) {
      check_once(out, 'n', where);
      add_formula(out, type[1][0] - '0', entry, where);
    } else {
      input_error(
          "{}: expected tabulated n, k or nk, or formula 1 to 9, got '{}'; the page of the substance on "
          "refractiveindex.info has its table under Data > CSV",
          where, entry.type);
    }
  }
  return out;
}

bool is_yaml(const std::string& name) {
  const std::string plain = lower(name);
  return plain.ends_with(".yml") || plain.ends_with(".yaml");
}

}  // namespace

bool is_optical_file(std::string name) {
  name = lower(name);
  return name.ends_with(".csv") || name.ends_with(".txt") || name.ends_with(".spd") || is_yaml(name);
}

OpticalFile read_optical_file(const std::filesystem::path& path) {
  const std::string file = path.string();
  if (lower(path.extension().string()) == ".spd") return read_spectra(path);
  const std::vector<std::string> lines = read_lines(path);
  const bool is_database =
      std::ranges::any_of(lines, [](const std::string& line) { return key_and_rest(line).first == "DATA"; });
  if (!is_database && is_yaml(file))
    input_error("{}: expected a file of refractiveindex.info's database (YAML), with a list DATA, found none", file);
  OpticalFile out = is_database ? read_database(lines, file) : read_table(lines, file);
  if (out.n.empty() && is_database) input_error("{}: expected n under DATA, found none", file);
  if (out.n.empty()) input_error("{}: expected a line wl,n and rows below it, found no n", file);
  return out;
}

}  // namespace brdfc::inline model
