// SPDX-License-Identifier: GPL-3.0-or-later
// Statements for all combinations of a model's choices.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "forms/recording.h"
#include "model/choices.h"
#include "print/statement.h"

namespace brdfc::forms {

/// Statements that differ by combination of choices: equal ones are there once.
class ChoiceSwitch {
 public:
  /// Both must outlive it. Choices among `fixed` are tested nowhere.
  ChoiceSwitch(const ModelInfo& info, const ParamValues& fixed) : info_(info), fixed_(fixed) {}

  void add(const Choices&, print::Statements);
  /// Cases by the parameters, or the statements alone where all are equal.
  print::Statements statements() const;

 private:
  print::Value condition(const std::vector<Choices>& combinations) const;
  const ModelInfo& info_;
  const ParamValues& fixed_;
  std::vector<std::pair<print::Statements, std::vector<Choices>>> cases_;
};

/// The arrays of all recordings of a shader, each once: combinations of choices share their tables.
class SharedArrays {
 public:
  /// Statements of a recording, before which stand the arrays whose names other ones have taken.
  print::Statements run(const Recording&);
  print::Statements declarations() const;

 private:
  std::map<std::string, std::shared_ptr<const Table>> known_;
};

}  // namespace brdfc::forms
