// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_library.h"

#include <cctype>
#include <set>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "print/osl_library_text.h"

namespace brdfc::print {
namespace {

struct Function {
  std::string name, text;  // the text includes the comment above the function
};

constexpr std::string_view kPrefix = "brdfc_";

/// The names that begin with the prefix and that a parenthesis follows, in order.
std::vector<std::string> names_in(const std::string& text) {
  const auto in_word = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
  std::vector<std::string> names;
  for (std::size_t at = text.find(kPrefix); at != std::string::npos; at = text.find(kPrefix, at + 1)) {
    std::size_t end = at;
    while (end < text.size() && in_word(text[end])) ++end;
    if ((at == 0 || !in_word(text[at - 1])) && end < text.size() && text[end] == '(')
      names.push_back(text.substr(at, end - at));
  }
  return names;
}

/// Splits the library into its functions, each with the comment in front of it. A function ends with a line "}".
std::vector<Function> parse_library() {
  std::vector<Function> functions;
  const std::string library = kOslLibrary;
  std::size_t start = library.find("\n\n") + 2;  // after the file's header
  while (start < library.size()) {
    const std::size_t end = library.find("\n}\n", start);
    if (end == std::string::npos) break;
    std::string text = library.substr(start, end + 3 - start);
    start = end + 3;
    while (!text.empty() && text.front() == '\n') text.erase(0, 1);
    std::size_t line = 0;
    while (text.compare(line, 2, "//") == 0) line = text.find('\n', line) + 1;
    const std::vector<std::string> names = names_in(text.substr(line, text.find('\n', line) - line));
    if (names.empty()) throw std::logic_error("OSL library: a paragraph without a function");
    functions.push_back({names.front(), text});
  }
  return functions;
}

std::set<std::string> calls_in(const std::string& text) {
  const std::vector<std::string> names = names_in(text);
  return {names.begin(), names.end()};
}

}  // namespace

std::string library_for(const std::set<std::string>& called) {
  static const std::vector<Function> functions = parse_library();
  std::set<std::string> wanted, known;
  for (const std::string& name : called)
    if (name.starts_with("brdfc_")) wanted.insert(name);
  // A function may only call those above it, so one pass from the end finds all that is needed.
  for (auto f = functions.rbegin(); f != functions.rend(); ++f) {
    known.insert(f->name);
    if (wanted.count(f->name)) wanted.merge(calls_in(f->text));
  }
  for (const std::string& name : wanted)
    if (!known.count(name)) throw std::logic_error("OSL library has no " + name);
  std::string out;
  for (const Function& f : functions)
    if (wanted.count(f.name)) out += f.text + "\n";
  return out;
}

}  // namespace brdfc::print
