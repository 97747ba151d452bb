// SPDX-License-Identifier: GPL-3.0-or-later
// The OSL text of a representation.
#pragma once

#include <string>
#include <vector>

#include "forms/aimed.h"
#include "forms/representation.h"
#include "measure/albedo_table.h"

namespace brdfc::pack {

struct Shader {
  std::string name;       ///< of the shader and, with .osl, of its file
  std::string source;     ///< stands alone
  std::string albedo;     ///< a shader of its own for the Albedo output; "" where `source` has it
  int closures = 0;       ///< most that one shading point adds
  int slots = 0;          ///< what they take of Cycles' kMaxClosures
  int operations = 0;     ///< most that one combination of choices executes, a loop's body counted once
  int statements = 0;     ///< of the shader for all combinations of choices, without the library it calls
  bool facets = false;    ///< has closures of facets
  int lamps = 0;          ///< slots of lamps that it aims at
  int closure_bytes = 0;  ///< most that they take of a GPU's kPoolBytes where no lamp is aimed at
  int lamp_bytes = 0;     ///< that each lamp adds
};

/// Parameters in `given` are folded into the text and are no parameters of the shader. `table` gives the Albedo
/// output, in a shader of its own where its text is longer than kMaxAlbedoText. An aimed form has parameters for
/// `max_lamps` lamps, and the base of this kind. The form is right for these `views`. Throws InputError if the closures
/// would exceed what Cycles keeps or the table what an array holds.
Shader write_shader(const Model&, forms::RepresentationKind, const measure::AlbedoTable& table,
                    const ParamValues& given = {}, const Cosines& views = {}, int max_lamps = forms::kMaxLamps,
                    forms::AimedBase base = forms::AimedBase::Declared);

/// Characters of tables that a shader holds for an output that most materials leave unlinked.
inline constexpr std::size_t kMaxAlbedoText = 4096;

}  // namespace brdfc::pack
