// SPDX-License-Identifier: GPL-3.0-or-later
// The models by name. Wrong declarations are accepted when a model is added, and reported when models are requested.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::inline model {

class Registry {
 public:
  /// Adds a model. Never throws because of a wrong declaration. `file` is the file with the declaration.
  void add(std::unique_ptr<Model>, const std::string& file);
  /// Throws InputError with a sentence for each wrong declaration: a name that is taken or is not an identifier, two
  /// parameters with the same name, contradictory ranges, a member that is not a parameter.
  const std::map<std::string, std::unique_ptr<Model>>& models() const;

 private:
  std::map<std::string, std::unique_ptr<Model>> models_;
  std::map<std::string, std::string> files_;  ///< by model name
  std::vector<std::string> errors_;
};

}  // namespace brdfc::inline model
