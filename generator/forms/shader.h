// SPDX-License-Identifier: GPL-3.0-or-later
// What a form is written as, and what it takes of Cycles.
#pragma once

#include <cstddef>
#include <string>

namespace brdfc::forms {

struct Shader {
  std::string name;       ///< of the shader and, with .osl, of its file; of a form of nodes with .json
  std::string source;     ///< stands alone
  std::string albedo;     ///< a shader of its own for the Albedo output; "" where `source` has it
  int closures = 0;       ///< most that one shading point adds
  int slots = 0;          ///< what they take of Cycles' kMaxClosures
  int operations = 0;     ///< most that one combination of choices executes, a loop's body counted once
  int statements = 0;     ///< of the shader for all combinations of choices, without the library it calls
  bool facets = false;    ///< has closures of facets
  bool leaning = false;   ///< has closures about normals of their own that Bump Map Correction changes
  int lamps = 0;          ///< slots of lamps that it aims at
  int closure_bytes = 0;  ///< most that they take of a GPU's kPoolBytes where no lamp is aimed at
  int lamp_bytes = 0;     ///< that each lamp adds
};

/// Characters of tables that a shader holds for an output that most materials leave unlinked.
inline constexpr std::size_t kMaxAlbedoText = 4096;

}  // namespace brdfc::forms
