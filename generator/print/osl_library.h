// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace brdfc::print {

/// The functions of osl/brdfc.osl.in that `text` calls, and those they call, in the order of the file. A call of a
/// brdfc_ function that the library does not have is a std::logic_error.
std::string library_for(const std::string& text);

}  // namespace brdfc::print
