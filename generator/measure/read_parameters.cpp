// SPDX-License-Identifier: GPL-3.0-or-later
#include "measure/read_parameters.h"

#include "trace/program.h"

namespace brdfc::measure {

std::set<std::string> read_parameters(const Model& model, const ParamValues& choices) {
  Recorder recorder(Precision::Double);
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(choices);
  const Vec3<Expr> wi = input3("wi"), wo = input3("wo");
  Program light;
  if (model.has_scatter()) light.output("f", brdf->eval(wi, wo));
  if (model.has_mirror()) light.output("mirror", brdf->mirror(wo));
  if (model.has_transmit()) light.output("transmit", brdf->transmit(wo));
  std::set<std::string> read;
  for (const std::string& name : light.inputs())
    if (model.info().param(name)) read.insert(name);
  return read;
}

}  // namespace brdfc::measure
