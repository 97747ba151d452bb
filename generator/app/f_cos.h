// SPDX-License-Identifier: GPL-3.0-or-later
// A table of values that several commands print.
#pragma once

#include <functional>

#include "core/vec.h"

namespace brdfc::app {

/// Reads pairs of directions above the surface, wi_x,wi_y,wi_z,wo_x,wo_y,wo_z, from stdin, and prints
/// f_cos_r,f_cos_g,f_cos_b.
void print_f_cos(const std::function<Rgb<double>(const Vec3<double>& wi, const Vec3<double>& wo)>& f_cos);

}  // namespace brdfc::app
