// SPDX-License-Identifier: GPL-3.0-or-later
#include "trace/fingerprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/hash.h"
#include "core/text.h"

namespace brdfc::inline trace {
namespace {

/// Rounded to six digits, and to multiples of 1e-9, so that different rounding in other libraries makes no difference.
std::string digits_of(const Table& table) {
  std::string text = table.name;
  for (const TableAxis& a : table.axes) text += fmt::format(" {}", a.size());
  for (const double v : table.values) {
    const double near = std::round(v * 1e9) / 1e9;
    text += fmt::format(" {:.6g}", near == 0 ? 0 : near);
  }
  return sha256(text);
}

}  // namespace

std::string fingerprint(const Program& program) {
  const std::vector<bool>& reached = program.reachable();
  std::vector<std::string> of(reached.size());
  std::map<const Table*, std::string> tables;
  for (std::size_t id = 0; id < reached.size(); ++id) {
    if (!reached[id]) continue;
    const ExprNode& n = program.node(int(id));
    std::string text = fmt::format("{} {}", name_of(n.op), int(n.type));
    switch (n.op) {
      case Op::Const:
        for (const double v : n.value) text += fmt::format(" {:.9g}", v == 0 ? 0 : v);
        break;
      case Op::Input:
        text += " " + n.name;
        break;
      case Op::Lookup: {
        std::string& digits = tables[n.table.get()];
        if (digits.empty()) digits = digits_of(*n.table);
        text += " " + digits;
        break;
      }
      case Op::Loop:  // the count; loops can't be nested, so an index identifies the variable of its loop
      case Op::LoopVar:
      case Op::LoopOut:
        text += fmt::format(" {}", n.index);
        break;
      default:
        break;
    }
    std::vector<std::string> args;
    for (const int a : n.args) args.push_back(of[std::size_t(a)]);
    if (n.op == Op::Add || n.op == Op::Mul) std::ranges::sort(args);
    of[id] = sha256(fmt::format("{} {}", text, join(args, " ")));
  }
  std::string text;
  for (const auto& [name, id] : program.outputs()) text += fmt::format("{} {}\n", name, of[std::size_t(id)]);
  return sha256(text);
}

}  // namespace brdfc::inline trace
