// SPDX-License-Identifier: GPL-3.0-or-later
// Models under their names, as they come in; what is wrong with their declarations is told when they are asked for.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc::inline model {

class Registry {
 public:
  /// Never throws for a declaration. `file` is the one it stands in.
  void add(std::unique_ptr<Model>, const std::string& file);
  /// Throws InputError with a sentence a declaration that is wrong: a name that is taken or is no identifier, a
  /// parameter named twice, ranges that contradict one another, a member that is no parameter.
  const std::map<std::string, std::unique_ptr<Model>>& models() const;

 private:
  std::map<std::string, std::unique_ptr<Model>> models_;
  std::map<std::string, std::string> files_;  ///< by names of models
  std::vector<std::string> errors_;
};

}  // namespace brdfc::inline model
