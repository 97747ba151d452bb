// SPDX-License-Identifier: GPL-3.0-or-later
// A twin as the extension builds it: what its nodes take, by the view.
#pragma once

#include "pack/shader.h"

namespace brdfc::pack {

/// The twin of a model with these parameters, which are all but factors() (fit/terms.h): its file, JSON with the file
/// name's extension left out of `name`, and what its nodes make of closures. `closures`: kind, and tables over the
/// cosine of the view, evenly spaced from 0 to 1 (fit/twin.h says what they are); `weight` and `albedo` by channel, one
/// where `tint` multiplies them. Factors multiply all but a mirror's weight.
Shader write_nodes(const Model&, const ParamValues& fixed);

}  // namespace brdfc::pack
