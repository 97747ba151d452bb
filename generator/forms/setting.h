// SPDX-License-Identifier: GPL-3.0-or-later
// What a form is made for.
#pragma once

#include "core/cosines.h"
#include "model/model.h"

namespace brdfc::forms {

/// Lamp slots that a shader of the extension has. Each that is in use costs an evaluation of the model per sample;
/// empty ones cost nothing.
inline constexpr int kMaxLamps = 8;

/// Where the base of a form that aims at lamps comes from: the model declares it, or closures are fitted to the model.
enum class AimedBase { Declared, Fitted };

struct Setting {
  ParamValues fixed = {};  ///< folded into the text: no parameters of the shader
  Cosines views = {};      ///< of the viewer, that it is right for
  int max_lamps = kMaxLamps;
  AimedBase base = AimedBase::Declared;
};

}  // namespace brdfc::forms
