// SPDX-License-Identifier: GPL-3.0-or-later
// Eight directions one after the other: for models that only look numbers up, and for processors for whose instruction
// set no model is compiled.
#include "model/model.h"

namespace brdfc::inline model {
namespace {

Vec3<double> get(const Vec3<Pack>& v, std::size_t k) { return lane(v, k); }
double get(const Pack& x, std::size_t k) { return x[k]; }
void set(Rgb<Pack>& to, std::size_t k, const Rgb<double>& value) {
  to.r[k] = value.r, to.g[k] = value.g, to.b[k] = value.b;
}

class OneByOne final : public PackedBrdf {
 public:
  explicit OneByOne(const std::function<std::unique_ptr<Brdf<double>>()>& make) {
    for (auto& brdf : lanes_) brdf = make();
  }
  PackedEvaluation evaluate(const Vec3<Pack>& wi, const Vec3<Pack>& wo) const override {
    PackedEvaluation out;
    for (std::size_t k = 0; k < kLanes; ++k) {
      set(out.f, k, lanes_[k]->eval(lane(wi, k), lane(wo, k)));
      out.pdf[k] = lanes_[k]->pdf(lane(wi, k), lane(wo, k));
    }
    return out;
  }
  Sample<Pack> sample(const Vec3<Pack>& wo, const Vec3<Pack>& u) const override {
    Sample<Pack> out;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const Sample<double> s = lanes_[k]->sample(lane(wo, k), lane(u, k));
      out.wi.x[k] = s.wi.x, out.wi.y[k] = s.wi.y, out.wi.z[k] = s.wi.z;
      set(out.weight, k, s.weight);
      out.pdf[k] = s.pdf;
    }
    return out;
  }
  Rgb<Pack> mirror(const Vec3<Pack>& wo) const override { return each(&Brdf<double>::mirror, wo); }
  Rgb<Pack> transmit(const Vec3<Pack>& wo) const override { return each(&Brdf<double>::transmit, wo); }
  Rgb<Pack> transmittance(const Pack& distance) const override { return each(&Brdf<double>::transmittance, distance); }
  Pack ior() const override {
    Pack out;
    for (std::size_t k = 0; k < kLanes; ++k) out[k] = lanes_[k]->ior();
    return out;
  }
  std::array<Pack, 3> channel_iors() const override {
    std::array<Pack, 3> out;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const std::array<double, 3> iors = lanes_[k]->channel_iors();
      for (std::size_t c = 0; c < 3; ++c) out[c][k] = iors[c];
    }
    return out;
  }
  void assign(const std::string& name, const std::array<Pack, 3>& value) override {
    for (std::size_t k = 0; k < kLanes; ++k) lanes_[k]->assign(name, {value[0][k], value[1][k], value[2][k]});
  }

 private:
  template <class Function, class Argument> Rgb<Pack> each(Function f, const Argument& argument) const {
    Rgb<Pack> out;
    for (std::size_t k = 0; k < kLanes; ++k) set(out, k, ((*lanes_[k]).*f)(get(argument, k)));
    return out;
  }

  std::array<std::unique_ptr<Brdf<double>>, kLanes> lanes_;
};

}  // namespace

std::unique_ptr<PackedBrdf> one_by_one(const std::function<std::unique_ptr<Brdf<double>>()>& make) {
  return std::make_unique<OneByOne>(make);
}

}  // namespace brdfc::inline model
