// SPDX-License-Identifier: GPL-3.0-or-later
// Statements that cover all combinations of a model's choices.
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

/// Selects statements by the combination of choices. Equal statements are written once.
class ChoiceSwitch {
 public:
  /// Both must outlive it. Choices in `fixed` are not tested.
  ChoiceSwitch(const ModelInfo& info, const ParamValues& fixed) : info_(info), fixed_(fixed) {}

  void add(const Choices&, print::Statements);
  /// The statements as cases of the choices, or without cases if all are equal.
  print::Statements statements() const;

 private:
  print::Value condition(const std::vector<Choices>& combinations) const;
  const ModelInfo& info_;
  const ParamValues& fixed_;
  std::vector<std::pair<print::Statements, std::vector<Choices>>> cases_;
};

/// The arrays of all recordings of a shader, without repetition: combinations of choices share their tables.
class SharedArrays {
 public:
  /// The statements of a recording, after the declarations of its arrays that are not declared yet.
  print::Statements run(const Recording&);
  print::Statements declarations() const;

 private:
  std::map<std::string, std::shared_ptr<const Table>> known_;
};

}  // namespace brdfc::forms
