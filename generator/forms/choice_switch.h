// SPDX-License-Identifier: GPL-3.0-or-later
// Statements of OSL for all combinations of a model's choices.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "forms/recording.h"
#include "model/choices.h"

namespace brdfc::forms {

/// Statements that differ by combination of choices: equal ones are written once.
class ChoiceSwitch {
 public:
  /// Both must outlive it. Choices among `fixed` are tested nowhere.
  ChoiceSwitch(const ModelInfo& info, const ParamValues& fixed) : info_(info), fixed_(fixed) {}

  void add(const Choices&, const std::string& statements);
  /// Branches on the parameters' names, or the statements alone where all are equal; `indent` is that of the branches.
  std::string print(int indent) const;

 private:
  std::string condition(const std::vector<Choices>& combinations) const;
  const ModelInfo& info_;
  const ParamValues& fixed_;
  std::vector<std::pair<std::string, std::vector<Choices>>> cases_;
};

/// The arrays of all statements of a shader, each once: combinations of choices share their tables.
class SharedArrays {
 public:
  /// The statements, before which stand the arrays whose names other ones have taken.
  std::string without_shared(const Recording&);
  std::string print() const;

 private:
  std::map<std::string, std::string> known_;
};

}  // namespace brdfc::forms
