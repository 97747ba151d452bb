// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <set>
#include <string>

namespace brdfc::print {

/// The source of these functions of osl/brdfc.osl.in (names that begin with brdfc_ only) and of the functions that they
/// call, in the order of the file. Throws std::logic_error for a function that the library does not have.
std::string library_for(const std::set<std::string>& functions);

}  // namespace brdfc::print
