// SPDX-License-Identifier: GPL-3.0-or-later
// A page of rounding error maps: formulas as papers print them beside those of this project, and every model over its
// first parameter.
#pragma once

#include <string>

namespace brdfc::report {

/// Writes DIR/index.html and its pictures. Throws InputError that names the path that can't be written.
void write_stability_page(const std::string& dir);

}  // namespace brdfc::report
