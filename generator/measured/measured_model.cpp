// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/measured_model.h"

#include "core/sequence.h"

namespace brdfc::measured {
namespace {

class MeasuredBrdf final : public OpaqueBrdf {
 public:
  MeasuredBrdf(std::shared_ptr<const Table> table, std::shared_ptr<const Sampler> sampling)
      : table_(std::move(table)), sampling_(std::move(sampling)) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override { return table_->eval(wi, wo); }
  double pdf(const Vec3<double>& wi, const Vec3<double>& wo) const override { return sampling_->pdf(wi, wo); }
  Sample<double> sample(const Vec3<double>& wo, const Vec3<double>& u) const override {
    Sample<double> s = sampling_->sample(wo, u);
    if (s.pdf > 0) s.weight = eval(s.wi, wo) * (s.wi.z / s.pdf);
    return s;
  }
  Rgb<double> mirror(const Vec3<double>&) const override { return Rgb<double>(0); }

 private:
  std::shared_ptr<const Table> table_;
  std::shared_ptr<const Sampler> sampling_;
};

/// The mean over some views of the second moment of samples' weights, relative to the square of their mean.
double second_moment(const Table& table, const Sampler& sampler) {
  constexpr int kViews = 6, kSamples = 512;
  double out = 0;
  for (int view = 0; view < kViews; ++view) {
    Sequence3 points(std::uint64_t(view) + 31);
    const Vec3<double> wo = direction(1 - (view + 0.5) / (kViews + 1), 2.4 * view);
    double first = 0, second = 0;
    for (int i = 0; i < kSamples; ++i) {
      const Sample<double> s = sampler.sample(wo, points.next());
      if (!(s.pdf > 0)) continue;
      const double weight = luminance(table.eval(s.wi, wo)) * s.wi.z / s.pdf;
      first += weight / kSamples, second += weight * weight / kSamples;
    }
    out += first > 0 ? second / (first * first) / kViews : 0;
  }
  return out;
}

std::shared_ptr<const Sampler> sampler_of(const Measurement& m) {
  auto of_half_vectors = std::make_shared<HalfVectors>(*m.table, m.isotropic);
  const auto own = m.table->sampler();
  if (own && second_moment(*m.table, *own) < second_moment(*m.table, *of_half_vectors)) return own;
  return of_half_vectors;
}

}  // namespace

MeasuredModel::MeasuredModel(const Measurement& m)
    : OpaqueModel({.name = "measured", .label = "Measured", .look = Look::Glossy}),
      table_(m.table),
      sampling_(sampler_of(m)) {
  info_.doc = m.file;
  info_.properties.isotropic = m.isotropic;
  info_.properties.exact_sampling = false;
}

std::unique_ptr<Brdf<double>> MeasuredModel::make_double(const ParamValues&) const {
  return std::make_unique<MeasuredBrdf>(table_, sampling_);
}
std::unique_ptr<PackedBrdf> MeasuredModel::make_packed(const ParamValues& values) const {
  return one_by_one([&] { return make_double(values); });  // reading a table is not computing
}

}  // namespace brdfc::measured
