// SPDX-License-Identifier: GPL-3.0-or-later
// The options that a form is made with.
#pragma once

#include "core/cosines.h"
#include "model/model.h"

namespace brdfc::forms {

/// Number of lamp slots in the extension's shaders. Each slot in use costs one evaluation of the model per sample;
/// empty slots cost nothing.
inline constexpr int kMaxLamps = 8;

/// The source of an aimed form's base: the closures that the model declares, or closures fitted to the model.
enum class AimedBase { Declared, Fitted };

struct Setting {
  ParamValues fixed = {};  ///< constants in the shader instead of parameters
  Cosines views = {};      ///< the range of views that it must be right for
  int max_lamps = kMaxLamps;
  AimedBase base = AimedBase::Declared;
};

}  // namespace brdfc::forms
