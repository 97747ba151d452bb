// SPDX-License-Identifier: GPL-3.0-or-later
#include "pack/recorded_model.h"

#include "model/under.h"

namespace brdfc::pack {

RecordedModel record_model(const Model& model, const Choices& choices, Precision precision) {
  Recorder recorder(precision);
  const std::unique_ptr<Brdf<Expr>> brdf = model.record(with_choices(model.info(), choices));
  const Vec3<Expr> wi = input3("wi"), wo = input3("wo");
  // All are recorded before programs are made of them, so that a name given in one formula also applies in the
  // others.
  Rgb<Expr> f, reflected, refracted, iors;
  Expr density;
  Sample<Expr> s;
  if (model.has_scatter()) {
    f = brdf->eval(wi, wo);
    density = brdf->pdf(wi, wo);
    s = brdf->sample(wo, input3("u"));
  }
  if (model.has_mirror()) reflected = brdf->mirror(wo);
  if (model.has_transmit()) {
    refracted = brdf->transmit(wo);
    const std::array<Expr, 3> of = brdf->channel_iors();
    iors = Rgb<Expr>(of[0], of[1], of[2]);
  }
  const bool through = model.has_through() && brdf->scatters_through();
  Expr ior(1);
  if (through) ior = brdf->ior();
  Rgb<Expr> transmittance;
  if (model.has_medium()) transmittance = brdf->transmittance(Expr::input("distance"));
  Expr stands(0);
  if (has_whole(model)) stands = under(model)->record_whole(model.info(), with_choices(model.info(), choices));
  RecordedModel out;
  if (model.has_scatter()) {
    out.eval.output("f", f);
    out.pdf.output("pdf", density);
    out.sample.output("wi", s.wi);
    out.sample.output("weight", s.weight);
    out.sample.output("pdf", s.pdf);
  }
  if (model.has_mirror()) out.mirror.output("weight", reflected);
  if (model.has_transmit()) {
    out.transmit.output("weight", refracted);
    out.iors.output("iors", iors);
  }
  if (through) out.ior.output("iors", Rgb<Expr>(ior));
  if (has_whole(model)) out.whole.output("stands", stands);
  if (model.has_medium()) out.inside.output("transmittance", transmittance);
  return out;
}

}  // namespace brdfc::pack
