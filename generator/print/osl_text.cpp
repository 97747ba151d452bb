// SPDX-License-Identifier: GPL-3.0-or-later
#include "print/osl_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "trace/graph.h"

namespace brdfc::print {

std::string number(double v) {
  const float f = float(v);
  if (!std::isfinite(f)) throw ExprError(fmt::format("{} is not a float", v));
  std::string s = fmt::format("{}", f);
  if (s.find_first_of(".e") == std::string::npos) s += ".0";
  return s;
}

std::string color(const std::array<double, 3>& c) {
  return fmt::format("color({}, {}, {})", number(c[0]), number(c[1]), number(c[2]));
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n')
      out += "\\n";
    else
      out += c;
  }
  return out + "\"";
}

std::string comment(const std::string& text) {
  std::string out = "//";
  std::size_t width = 2;
  std::size_t start = 0;
  while (start < text.size()) {
    std::size_t end = text.find(' ', start);
    if (end == std::string::npos) end = text.size();
    if (width + 1 + end - start > 118) {
      out += "\n//";
      width = 2;
    }
    out.append(" ").append(text, start, end - start);
    width += 1 + end - start;
    start = end + 1;
  }
  return out + "\n";
}

std::string indented(const std::string& text, std::size_t levels) {
  std::string out;
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = text.find('\n', start);
    if (end > start) out += std::string(4 * levels, ' ');
    out += text.substr(start, end + 1 - start);
    start = end + 1;
  }
  return out;
}

std::string narrow(const std::string& text) {
  std::string out;
  std::size_t start = 0;
  while (start < text.size()) {
    const std::size_t end = std::min(text.find('\n', start), text.size());
    const std::size_t word = std::min(text.find_first_not_of(' ', start), end);
    out += std::string((word - start) / 2, ' ') + text.substr(word, end + 1 - word);
    start = end + 1;
  }
  return out;
}

std::string array(const std::string& name, const std::vector<double>& values) {
  std::string out = fmt::format("    float {}[{}] = {{", name, values.size());
  std::size_t width = 200;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string v = number(values[i]);
    if (width + v.size() + 2 > 116) {
      out += "\n        ";
      width = 8;
    }
    out += v + (i + 1 < values.size() ? ", " : "");
    width += v.size() + 2;
  }
  return out + "\n    };\n";
}

}  // namespace brdfc::print
