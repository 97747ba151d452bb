// SPDX-License-Identifier: GPL-3.0-or-later
#include "app/f_cos.h"

#include <iostream>

#include "core/csv.h"
#include "core/error.h"

namespace brdfc::app {

void print_f_cos(const std::function<Rgb<double>(const Vec3<double>& wi, const Vec3<double>& wo)>& f_cos) {
  CsvReader in(std::cin, "stdin", {"wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"});
  if (in.empty()) input_error("stdin: expected a CSV table with the header wi_x,wi_y,wi_z,wo_x,wo_y,wo_z");
  CsvWriter out("f_cos_r,f_cos_g,f_cos_b");
  std::vector<double> row;
  while (in.next(row)) {
    const Vec3<double> wi = in.unit_vector(row, 0), wo = in.unit_vector(row, 3);
    if (!(wi.z > 0 && wo.z > 0)) input_error("{}: expected directions above the surface", in.where());
    const Rgb<double> f = f_cos(wi, wo);
    out.row({f.r, f.g, f.b});
  }
  out.flush();
}

}  // namespace brdfc::app
