// SPDX-License-Identifier: GPL-3.0-or-later
// The shader or node tree that a form is written as, and the resources that it needs in Cycles.
#pragma once

#include <cstddef>
#include <string>

namespace brdfc::forms {

struct Shader {
  std::string name;      ///< name of the shader; its file adds .osl, or .json for a form made of nodes
  std::string source;    ///< complete source text
  std::string albedo;    ///< source of a separate shader for the Albedo output; empty if `source` contains it
  int closures = 0;      ///< maximum number of closures that one shading point adds
  int slots = 0;         ///< slots that they take, of Cycles' kMaxClosures
  int numbers = 0;       ///< that Cycles keeps at a time for the formula of a lamp, if it consists of Blender's nodes
  int operations = 0;    ///< maximum over the combinations of choices; the body of a loop counts once
  int statements = 0;    ///< for all combinations of choices, without the library functions
  bool facets = false;   ///< uses microfacet closures
  bool leaning = false;  ///< uses closures with their own normals, which Bump Map Correction changes
  int lamps = 0;         ///< number of lamp slots
};

/// If the table for the Albedo output is longer than this, it gets a separate shader, because most materials leave that
/// output unlinked.
inline constexpr std::size_t kMaxAlbedoText = 4096;

}  // namespace brdfc::forms
