// SPDX-License-Identifier: GPL-3.0-or-later
// Maps of rounding errors as a page: the forms that papers print beside ours, and every model over its first parameter.
#pragma once

#include <string>

namespace brdfc::report {

/// Writes DIR/index.html and its pictures. Throws InputError naming the path that can't be written.
void write_stability_page(const std::string& dir);

}  // namespace brdfc::report
