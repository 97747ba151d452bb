// SPDX-License-Identifier: GPL-3.0-or-later
// What several tests need.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace brdfc {

/// All parameters of a model, those in `text` as name=value, the others as they are by default.
inline ParamValues values_of(const Model& m, const std::vector<std::string>& text) {
  return complete(m.info(), parse_values(m.info(), text));
}

}  // namespace brdfc
