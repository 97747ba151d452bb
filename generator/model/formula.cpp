// SPDX-License-Identifier: GPL-3.0-or-later
#include "model/formula.h"

namespace brdfc {

std::string formula(const Model& model, const ParamValues& fixed) {
  Recorder recorder;
  const auto direction = [](const char* x, const char* y, const char* z) {
    return Vec3<Expr>{Expr::input(x), Expr::input(y), Expr::input(z)};
  };
  const Vec3<Expr> wi = direction("wi_x", "wi_y", "wi_z"), wo = direction("wo_x", "wo_y", "wo_z");
  const auto brdf = model.record(fixed);
  const Sample<Expr> sample = brdf->sample(wo, direction("u1", "u2", "u3"));
  Program program;
  program.output("f", brdf->eval(wi, wo));
  program.output("pdf", brdf->pdf(wi, wo));
  program.output("sample_x", sample.wi.x);
  program.output("sample_y", sample.wi.y);
  program.output("sample_z", sample.wi.z);
  program.output("sample_weight", sample.weight);
  program.output("sample_pdf", sample.pdf);
  program.output("mirror", brdf->mirror(wo));
  program.output("transmit", brdf->transmit(wo));
  program.output("ior", brdf->ior());
  return program.print_osl(0, {});
}

}  // namespace brdfc
