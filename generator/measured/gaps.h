// SPDX-License-Identifier: GPL-3.0-or-later
// What a grid over half and difference angles has where nothing was measured.
#pragma once

#include <span>

#include "measured/grid_table.h"

namespace brdfc::measured {

/// What fill_gaps() does, in words for a message.
inline constexpr const char* kFilled =
    "filled along theta_d; where a row has nothing, along phi_d, then theta_h: linear in between, constant beyond";

/// Fills entries that are NaN from the nearest ones along `order[0]`; those of lines that have nothing, along
/// `order[1]` then, and so on. Only entries that are `above` the horizon are filled, and give values. The last of the
/// axes runs fastest.
void fill_gaps(std::vector<std::array<float, 3>>& values, std::span<const AngleAxis* const> axes,
               std::span<const std::size_t> order, const std::vector<bool>& above);

}  // namespace brdfc::measured
