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

template <class T> void set(Rgb<T>& to, std::size_t lane, const Rgb<double>& value) {
  to.r[lane] = value.r, to.g[lane] = value.g, to.b[lane] = value.b;
}
Vec3<double> get(const Vec3<Pack>& v, std::size_t lane) { return {v.x[lane], v.y[lane], v.z[lane]}; }

/// Looks eight directions up, one after the other: reading a table is not computing.
class PackedMeasured final : public OpaquePacked {
 public:
  explicit PackedMeasured(std::unique_ptr<Brdf<double>> brdf) : brdf_(std::move(brdf)) {}
  PackedEvaluation evaluate(const Vec3<Pack>& wi, const Vec3<Pack>& wo) const override {
    PackedEvaluation out{Rgb<Pack>(Pack(0)), Pack(0)};
    for (std::size_t k = 0; k < kLanes; ++k) {
      set(out.f, k, brdf_->eval(get(wi, k), get(wo, k)));
      out.pdf[k] = brdf_->pdf(get(wi, k), get(wo, k));
    }
    return out;
  }
  Sample<Pack> sample(const Vec3<Pack>& wo, const Vec3<Pack>& u) const override {
    Sample<Pack> out{{Pack(0), Pack(0), Pack(1)}, Rgb<Pack>(Pack(0)), Pack(0)};
    for (std::size_t k = 0; k < kLanes; ++k) {
      const Sample<double> s = brdf_->sample(get(wo, k), get(u, k));
      out.wi.x[k] = s.wi.x, out.wi.y[k] = s.wi.y, out.wi.z[k] = s.wi.z;
      set(out.weight, k, s.weight);
      out.pdf[k] = s.pdf;
    }
    return out;
  }
  Rgb<Pack> mirror(const Vec3<Pack>&) const override { return Rgb<Pack>(Pack(0)); }

 private:
  std::unique_ptr<Brdf<double>> brdf_;
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
  return std::make_unique<PackedMeasured>(make_double(values));
}

}  // namespace brdfc::measured
