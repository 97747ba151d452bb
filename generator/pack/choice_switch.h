// SPDX-License-Identifier: GPL-3.0-or-later
// Statements that differ by combination of choices, as one text of branches.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "model/choices.h"

namespace brdfc::pack {

/// Statements that differ by combination of choices: equal ones are written once.
class ChoiceSwitch {
 public:
  /// Both must outlive it. Choices among `fixed` are tested nowhere.
  ChoiceSwitch(const ModelInfo& info, const ParamValues& fixed) : info_(info), fixed_(fixed) {}

  void add(const Choices& choices, const std::string& statements);
  /// Branches on the parameters' names, or the statements alone where all are equal; `indent` is that of the branches.
  std::string print(int indent) const;

 private:
  std::string condition(const std::vector<Choices>& combinations) const;
  /// Whether every value of choice k stands in the combinations with the others as in c.
  static bool covers(const std::vector<Choices>& combinations, Choices c, std::size_t k, int size);

  const ModelInfo& info_;
  const ParamValues& fixed_;
  std::vector<std::pair<std::string, std::vector<Choices>>> cases_;
};

}  // namespace brdfc::pack
