// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/error.h"

namespace brdfc::inline core {

void throw_input_error(fmt::string_view format, fmt::format_args args) { throw InputError(fmt::vformat(format, args)); }

}  // namespace brdfc::inline core
