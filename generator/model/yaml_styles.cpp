// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/yaml_styles.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <stdexcept>

namespace brdfc::inline model {
namespace {

/// The value goes on in the next line.
struct Open {};

bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Stands for a line end that is written as an escape, which folding leaves.
constexpr char kLineEnd = '\v';

/// The text without the escapes of double quotes; a line end after a backslash is none.
std::string without_escapes(const std::string& raw) {
  static const std::map<char, char> kEscapes{{'n', kLineEnd}, {'t', '\t'}, {'r', '\r'},  {'0', '\0'},
                                             {' ', ' '},      {'"', '"'},  {'\\', '\\'}, {'/', '/'}};
  std::string out;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\\' || i + 1 == raw.size()) {
      out += raw[i];
    } else if (raw[++i] == '\n') {
      while (i + 1 < raw.size() && is_blank(raw[i + 1])) ++i;
    } else if (const auto at = kEscapes.find(raw[i]); at != kEscapes.end()) {
      out += at->second;
    } else {
      out += '\\', out += raw[i];
    }
  }
  return out;
}

/// Line ends become spaces, and empty lines line ends.
std::string folded(const std::string& text) {
  std::string out;
  std::size_t empty = 0, start = 0;
  for (bool first = true; start <= text.size(); first = false) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::string line = trimmed(text.substr(start, end - start));
    start = end + 1;
    if (first) {
      out = line;
    } else if (line.empty()) {
      ++empty;
    } else {
      out += (empty ? std::string(empty, '\n') : " ") + line;
      empty = 0;
    }
  }
  out += std::string(empty, '\n');
  for (char& c : out)
    if (c == kLineEnd) c = '\n';
  return out;
}

class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {}

  YamlValue value() {
    const char first = peek();
    if (first == '{') return mapping();
    if (first == '[') return list();
    YamlValue out;
    out.text = first == '"' || first == '\'' ? quoted(first) : plain();
    return out;
  }

  bool is_over() const {
    const auto next = text_.find_first_not_of(" \t\n", at_);
    return next == std::string::npos || text_[next] == '#';
  }

 private:
  char peek() {
    at_ = text_.find_first_not_of(" \t\n", at_);
    if (at_ == std::string::npos) throw Open();
    return text_[at_];
  }

  /// Within brackets: up to what ends it.
  std::string plain() {
    const std::string ends = ",[]{}\n";
    const std::size_t start = at_;
    for (; at_ < text_.size() && ends.find(text_[at_]) == std::string::npos; ++at_) {
      const char next = at_ + 1 < text_.size() ? text_[at_ + 1] : '\n';
      if (text_[at_] == ':' && (is_blank(next) || ends.find(next) != std::string::npos)) break;
    }
    return trimmed(text_.substr(start, at_ - start));
  }

  std::string quoted(char quote) {
    const std::size_t start = at_ + 1;
    std::size_t end = start;
    for (; end < text_.size(); ++end) {
      const bool twice = quote == '\'' && text_.compare(end, 2, "''") == 0;
      if (twice || (text_[end] == '\\' && quote == '"'))
        ++end;
      else if (text_[end] == quote)
        break;
    }
    if (end >= text_.size()) throw Open();
    at_ = end + 1;
    std::string raw = text_.substr(start, end - start);
    if (quote == '"') return folded(without_escapes(raw));
    for (std::size_t i = 0; (i = raw.find("''", i)) != std::string::npos; ++i) raw.erase(i, 1);
    return folded(raw);
  }

  template <class Add> void items(char end, const Add& add) {
    if (++depth_ > kMostDeep) throw std::invalid_argument("too deep");
    ++at_;
    while (peek() != end) {
      add();
      if (peek() == ',')
        ++at_;
      else if (peek() != end)
        throw std::invalid_argument("no comma");
    }
    ++at_;
    --depth_;
  }

  YamlValue list() {
    YamlValue out{YamlValue::Kind::List, {}, {}, {}};
    items(']', [&] { out.list.push_back(value()); });
    return out;
  }

  YamlValue mapping() {
    YamlValue out{YamlValue::Kind::Mapping, {}, {}, {}};
    items('}', [&] {
      const YamlValue key = value();
      if (key.kind != YamlValue::Kind::Text || peek() != ':') throw std::invalid_argument("no key");
      ++at_;
      out.keys.push_back(key.text);
      out.list.push_back(peek() == ',' || peek() == '}' ? YamlValue{} : value());
    });
    return out;
  }

  /// Files have lists of mappings of lists of rows.
  static constexpr int kMostDeep = 8;

  const std::string& text_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

}  // namespace

bool is_styled(const std::string& text) {
  return !text.empty() && std::string("\"'[{").find(text[0]) != std::string::npos;
}

int unclosed(const std::string& line) {
  int out = 0;
  for (const char c : line) out += (c == '[' || c == '{') - (c == ']' || c == '}');
  return out;
}

bool may_end(const std::string& text, const std::string& line, int still_open) {
  return text[0] == '"' || text[0] == '\'' ? line.find(text[0]) != std::string::npos : still_open <= 0;
}

std::optional<YamlValue> yaml_value(const std::string& text) {
  Reader reader(text);
  try {
    YamlValue out = reader.value();
    if (!reader.is_over()) throw std::invalid_argument("more than a value");
    return out;
  } catch (const Open&) {
    return std::nullopt;
  }
}

std::pair<std::string, std::string> key_and_rest(const std::string& line) {
  const std::pair<std::string, std::string> none{"", line};
  if (line.empty()) return none;
  std::size_t end;
  std::string key;
  if (line[0] == '"' || line[0] == '\'') {
    end = line.find(line[0], 1);
    if (end == std::string::npos) return none;
    key = line.substr(1, end++ - 1);
  } else if (std::isalpha(static_cast<unsigned char>(line[0])) || line[0] == '_') {
    end = line.find_first_of(":'\"{}[]");
    if (end == std::string::npos) return none;
    key = trimmed(line.substr(0, end));
  } else {
    return none;
  }
  end = line.find_first_not_of(" \t", end);
  if (end == std::string::npos || line[end] != ':') return none;
  if (end + 1 < line.size() && !is_blank(line[end + 1])) return none;
  return {key, trimmed(line.substr(end + 1))};
}

}  // namespace brdfc::inline model
