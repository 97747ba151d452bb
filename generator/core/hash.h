// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace brdfc::inline core {

/// SHA-256 of the bytes, as 64 hexadecimal digits.
std::string sha256(const std::string& bytes);

}  // namespace brdfc::inline core
