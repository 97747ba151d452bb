// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

#include "model/model.h"

namespace brdfc {

/// The text of all that the model computes with these values fixed: equal texts are equal models.
std::string formula(const Model&, const ParamValues& fixed);

}  // namespace brdfc
