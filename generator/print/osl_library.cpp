// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_library.h"

#include <regex>
#include <set>
#include <stdexcept>
#include <vector>

#include "print/osl_library_text.h"

namespace brdfc::print {
namespace {

struct Function {
  std::string name, text;  // the text includes the comment above the function
};

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
    std::smatch match;
    if (!std::regex_search(text, match, std::regex(R"((?:^|\n)[a-z][a-z ]* (brdfc_\w+)\()")))
      throw std::logic_error("OSL library: a paragraph without a function");
    functions.push_back({match[1], text});
  }
  return functions;
}

std::set<std::string> calls_in(const std::string& text) {
  std::set<std::string> names;
  static const std::regex call(R"(\b(brdfc_\w+)\()");
  for (auto it = std::sregex_iterator(text.begin(), text.end(), call); it != std::sregex_iterator(); ++it)
    names.insert((*it)[1]);
  return names;
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
