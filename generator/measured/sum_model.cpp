// SPDX-License-Identifier: GPL-3.0-or-later
#include "measured/sum_model.h"

#include <algorithm>

#include "core/sequence.h"
#include "core/text.h"
#include "measure/albedo.h"
#include "model/sampling.h"

namespace brdfc::measured {
namespace {

constexpr int kShareRows = 32, kShareSamples = 256;
/// A lobe that reflects anything at all is sampled at least so often, because its albedo is known for a few views only.
constexpr double kLeast = 0.02;

/// Where layers know what they let through: at the squares of equal steps from 0 to 1.
constexpr int kPassedSteps = 128, kPassedSamples = 1 << 13;

using Views = SumModel::Views;
template <class Term> using Terms = std::vector<std::unique_ptr<Term>>;

/// The lobe that a random number chooses; `u` becomes a random number for that lobe.
std::size_t choose(const std::vector<double>& shares, double& u) {
  double before = 0;
  std::size_t last = 0;
  for (std::size_t k = 0; k < shares.size(); ++k) {
    if (!(shares[k] > 0)) continue;
    last = k;
    if (u < before + shares[k]) break;
    before += shares[k];
  }
  // Rounding may leave `u` at the end of the last lobe.
  u = std::clamp((u - before) / shares[last], 0., 1 - 1e-16);
  return last;
}

class SumBrdf final : public OpaqueBrdf {
 public:
  SumBrdf(Terms<Brdf<double>> terms, std::shared_ptr<const Views> views)
      : terms_(std::move(terms)), views_(std::move(views)) {}
  Rgb<double> eval(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    Rgb<double> f(0);
    for (std::size_t k = 0; k < terms_.size(); ++k) f += views_->passed(k, wo.z) * terms_[k]->eval(wi, wo);
    return f;
  }
  double pdf(const Vec3<double>& wi, const Vec3<double>& wo) const override {
    const std::vector<double>& shares = views_->shares(wo.z);
    double p = 0;
    for (std::size_t k = 0; k < terms_.size(); ++k)
      if (shares[k] > 0) p += shares[k] * terms_[k]->pdf(wi, wo);
    return p;
  }
  Sample<double> sample(const Vec3<double>& wo, const Vec3<double>& u) const override {
    double first = u.x;
    const std::size_t k = choose(views_->shares(wo.z), first);
    Sample<double> s = terms_[k]->sample(wo, {first, u.y, u.z});
    if (!(s.pdf > 0)) return {s.wi, Rgb<double>(0), 0};
    s.pdf = pdf(s.wi, wo);
    s.weight = eval(s.wi, wo) * (s.wi.z / s.pdf);
    return s;
  }
  Rgb<double> mirror(const Vec3<double>& wo) const override {
    Rgb<double> out(0);
    for (std::size_t k = 0; k < terms_.size(); ++k) out += views_->passed(k, wo.z) * terms_[k]->mirror(wo);
    return out;
  }

 private:
  Terms<Brdf<double>> terms_;
  std::shared_ptr<const Views> views_;
};

class PackedSum final : public OpaquePacked {
 public:
  PackedSum(Terms<PackedBrdf> terms, std::shared_ptr<const Views> views)
      : terms_(std::move(terms)), views_(std::move(views)) {}
  PackedEvaluation evaluate(const Vec3<Pack>& wi, const Vec3<Pack>& wo) const override {
    PackedEvaluation out{Rgb<Pack>(Pack(0)), Pack(0)};
    std::array<const std::vector<double>*, kLanes> shares;
    for (std::size_t lane = 0; lane < kLanes; ++lane) shares[lane] = &views_->shares(wo.z[lane]);
    for (std::size_t k = 0; k < terms_.size(); ++k) {
      const PackedEvaluation e = terms_[k]->evaluate(wi, wo);
      Pack share;
      for (std::size_t lane = 0; lane < kLanes; ++lane) share[lane] = (*shares[lane])[k];
      out.f += e.f * passed(k, wo);
      out.pdf = out.pdf + share * e.pdf;
    }
    return out;
  }
  Sample<Pack> sample(const Vec3<Pack>& wo, const Vec3<Pack>& u) const override {
    std::array<std::size_t, kLanes> chosen;
    Vec3<Pack> v = u;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      double first = u.x[lane];
      chosen[lane] = choose(views_->shares(wo.z[lane]), first);
      v.x[lane] = first;
    }
    Sample<Pack> out{{Pack(0), Pack(0), Pack(1)}, Rgb<Pack>(Pack(0)), Pack(0)};
    for (std::size_t k = 0; k < terms_.size(); ++k) {
      if (std::ranges::find(chosen, k) == chosen.end()) continue;
      const Sample<Pack> s = terms_[k]->sample(wo, v);
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (chosen[lane] != k) continue;
        out.wi.x[lane] = s.wi.x[lane], out.wi.y[lane] = s.wi.y[lane], out.wi.z[lane] = s.wi.z[lane];
        out.pdf[lane] = s.pdf[lane];
      }
    }
    const PackedEvaluation e = evaluate(out.wi, wo);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (!(out.pdf[lane] > 0)) continue;
      out.pdf[lane] = e.pdf[lane];
      const double scale = out.wi.z[lane] / e.pdf[lane];
      out.weight.r[lane] = e.f.r[lane] * scale, out.weight.g[lane] = e.f.g[lane] * scale;
      out.weight.b[lane] = e.f.b[lane] * scale;
    }
    return out;
  }
  Rgb<Pack> mirror(const Vec3<Pack>& wo) const override {
    Rgb<Pack> out(Pack(0));
    for (std::size_t k = 0; k < terms_.size(); ++k) out += terms_[k]->mirror(wo) * passed(k, wo);
    return out;
  }

 private:
  Pack passed(std::size_t k, const Vec3<Pack>& wo) const {
    if (!views_->dims()) return Pack(1);
    Pack out;
    for (std::size_t lane = 0; lane < kLanes; ++lane) out[lane] = views_->passed(k, wo.z[lane]);
    return out;
  }

  Terms<PackedBrdf> terms_;
  std::shared_ptr<const Views> views_;
};

Terms<Brdf<double>> terms_of(const std::vector<Lobe>& lobes) {
  Terms<Brdf<double>> out;
  for (const Lobe& lobe : lobes) out.push_back(lobe.model->make_double(lobe.values));
  return out;
}

}  // namespace

Views::Views(const std::vector<std::unique_ptr<Brdf<double>>>& terms, Stack stack)
    : shares_(kShareRows, std::vector<double>(terms.size())) {
  if (stack == Stack::Layers) {
    passed_.emplace_back(kPassedSteps + 1, 1.);
    for (std::size_t k = 0; k + 1 < terms.size(); ++k) {
      std::vector<double> below = passed_[k];
      for (int i = 0; i <= kPassedSteps; ++i) {
        const double x = std::max(i, 1) / double(kPassedSteps);  // no model has a value at the horizon
        const measure::MeanAlbedo a = measure::mean_albedos(*terms[k], {terms[k].get()}, x * x, std::nullopt,
                                                            fmt::format("layer {}", k + 1), kPassedSamples);
        below[std::size_t(i)] *= std::max(1 - max_component(a.scattered[0] + a.mirror[0]), 0.);
      }
      passed_.push_back(std::move(below));
    }
  }
  for (int row = 0; row < kShareRows; ++row) {
    std::vector<double>& shares = shares_[std::size_t(row)];
    double sum = 0;
    for (std::size_t k = 0; k < terms.size(); ++k) {
      Sequence3 points(std::uint64_t(row) + 1);
      Sequence2 views(std::uint64_t(row) + 101);
      for (int i = 0; i < kShareSamples; ++i) {
        const Point2 v = views.next();
        const Vec3<double> wo = direction((row + v.x) / kShareRows, 2 * kPi * v.y);
        const Sample<double> s = terms[k]->sample(wo, points.next());
        if (s.pdf > 0) shares[k] += passed(k, wo.z) * luminance(s.weight) / kShareSamples;
      }
      sum += shares[k];
    }
    // Nothing was reflected in this row: all lobes alike.
    if (!(sum > 0)) std::ranges::fill(shares, 1), sum = double(terms.size());
    double all = 0;
    for (double& s : shares) all += s = std::max(s / sum, kLeast);
    for (double& s : shares) s /= all;
  }
}

const std::vector<double>& Views::shares(double cosTheta_o) const {
  return shares_[std::size_t(std::clamp(int(cosTheta_o * kShareRows), 0, kShareRows - 1))];
}

double Views::passed(std::size_t lobe, double cosTheta_o) const {
  if (!dims()) return 1;
  const double at = std::sqrt(std::clamp(cosTheta_o, 0., 1.)) * kPassedSteps;
  const std::size_t i = std::min(std::size_t(at), std::size_t(kPassedSteps - 1));
  return std::lerp(passed_[lobe][i], passed_[lobe][i + 1], at - double(i));
}

SumModel::SumModel(std::vector<Lobe> lobes, Stack stack)
    : OpaqueModel({.name = stack == Stack::Layers ? "layers" : "sum",
                   .label = stack == Stack::Layers ? "Layers" : "Sum",
                   .look = Look::Matte}),
      lobes_(std::move(lobes)) {
  std::vector<std::string> names;
  for (const Lobe& lobe : lobes_) {
    const ModelInfo& each = lobe.model->info();
    names.push_back(each.name);
    if (each.look != Look::Matte) info_.look = Look::Glossy;
    info_.properties.reciprocal &= each.properties.reciprocal && stack == Stack::Sum;
    info_.properties.isotropic &= each.properties.isotropic;
  }
  info_.doc = join(names, stack == Stack::Layers ? " over " : " + ");
  info_.properties.conserving = info_.properties.exact_sampling = false;
  views_ = std::make_shared<Views>(terms_of(lobes_), stack);
}

bool SumModel::has_scatter() const {
  return std::ranges::any_of(lobes_, [](const Lobe& lobe) { return lobe.model->has_scatter(); });
}
bool SumModel::has_mirror() const {
  return std::ranges::any_of(lobes_, [](const Lobe& lobe) { return lobe.model->has_mirror(); });
}

std::unique_ptr<Brdf<double>> SumModel::make_double(const ParamValues&) const {
  return std::make_unique<SumBrdf>(terms_of(lobes_), views_);
}
std::unique_ptr<PackedBrdf> SumModel::make_packed(const ParamValues&) const {
  Terms<PackedBrdf> terms;
  for (const Lobe& lobe : lobes_) terms.push_back(lobe.model->make_packed(lobe.values));
  return std::make_unique<PackedSum>(std::move(terms), views_);
}

}  // namespace brdfc::measured
