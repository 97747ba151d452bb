// SPDX-License-Identifier: GPL-3.0-or-later
// Shaders of models that closures of Cycles equal for some parameters.
#pragma once

#include "forms/osl_form.h"

namespace brdfc::forms {

/// Where closures of Cycles equal the model, these are all that the shader has to be: adds ShaderBody::whole and
/// `of_whole`. Throws std::logic_error for closures that are no facets.
void add_whole(ShaderBody&);

}  // namespace brdfc::forms
