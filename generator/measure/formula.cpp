// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/formula.h"

#include "trace/fingerprint.h"
#include "trace/program.h"

namespace brdfc::measure {

std::string formula_of(const Model& model, const ParamValues& fixed) {
  Recorder recorder;
  const Vec3<Expr> wi = input3("wi"), wo = input3("wo");
  const auto brdf = model.record(fixed);
  const Sample<Expr> sample = brdf->sample(wo, input3("u"));
  Program program;
  program.output("f", brdf->eval(wi, wo));
  program.output("pdf", brdf->pdf(wi, wo));
  program.output("sample", sample.wi);
  program.output("sample_weight", sample.weight);
  program.output("sample_pdf", sample.pdf);
  program.output("mirror", brdf->mirror(wo));
  program.output("transmit", brdf->transmit(wo));
  program.output("ior", brdf->ior());
  if (model.has_transmit()) {
    const std::array<Expr, 3> iors = brdf->channel_iors();
    program.output("channel_iors", Vec3<Expr>{iors[0], iors[1], iors[2]});
  }
  return fingerprint(program);
}

}  // namespace brdfc::measure
