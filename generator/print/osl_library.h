// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <set>
#include <string>

namespace brdfc::print {

/// Those of these functions that are osl/brdfc.osl.in's, which begin with brdfc_, and those they call, in the order of
/// the file. One that the library does not have is a std::logic_error.
std::string library_for(const std::set<std::string>& functions);

}  // namespace brdfc::print
